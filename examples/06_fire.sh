#!/bin/sh
# 06: a fire lights a bunny: a sequence of images as the light, a mask for each.
#
# Expected: mean visibility 0.7232
#
# 06_fire_frames.py makes eight frames of a fire from noise; 06_fire.json has them as the emission of a rectangle. penumbra finds the bunny's
# silhouettes once and makes a table of each frame; each frame has a mask of three channels: red reaches higher than yellow and white do.
# The number is the mean over all frames, pixels and channels.
#
# The program is $PENUMBRA, or else `penumbra` on the path; pictures go to a temporary folder.
set -eu
examples=$(cd "$(dirname "$0")" && pwd)
penumbra=${PENUMBRA:-penumbra}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3 "$examples/06_fire_frames.py" "$work" 8

# File names in a scene are relative to it.
cp "$examples/06_fire.json" "$work/scene.json"
"$penumbra" mask "$work/scene.json" -o "$work/mask.pfm"
ls "$work"

# A PFM file ends in its pixels: 192 x 144 of three float32.
for frame in 1 2 3 4 5 6 7 8; do
    tail -c $((192 * 144 * 3 * 4)) "$work/mask.000$frame.pfm"
done | od -An -v -tf4 |
    LC_ALL=C awk '{ for (i = 1; i <= NF; i++) { sum += $i; count++ } } END { printf "mean visibility %.4f\n", sum / count }'
