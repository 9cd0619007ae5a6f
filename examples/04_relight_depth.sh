#!/bin/sh
# 04: a new light in a picture of which only one camera's depth is left.
#
# Expected: mean visibility 0.9141
#
# A camera looks at the floor and the square of 01 from the side. Its depth image stands for what a renderer's depth pass or a depth sensor
# gives. In 04_relight_depth.json it casts and it receives, under a light at another place. Rays walk through the image itself: technique
# depth_trace, the default where all that casts is depth. How thick things are is guessed. Shadow rays through the objects give 0.9149.
#
# The program is $PENUMBRA, or else `penumbra` on the path; pictures go to a temporary folder.
set -eu
examples=$(cd "$(dirname "$0")" && pwd)
penumbra=${PENUMBRA:-penumbra}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# The depth image, view/receiver.exr; from here on the objects are forgotten.
"$penumbra" depth "$examples/04_relight_depth_view.json" --out "$work/view"

# File names in a scene are relative to it.
cp "$examples/04_relight_depth.json" "$work/scene.json"
"$penumbra" mask "$work/scene.json" -o "$work/mask.pfm"

# A PFM file ends in its pixels: 256 x 256 float32.
tail -c $((256 * 256 * 4)) "$work/mask.pfm" | od -An -v -tf4 |
    LC_ALL=C awk '{ for (i = 1; i <= NF; i++) { sum += $i; count++ } } END { printf "mean visibility %.4f\n", sum / count }'
