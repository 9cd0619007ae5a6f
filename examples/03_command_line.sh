#!/bin/sh
# 03: the scene of 01 from a file, by the command line, held against shadow rays.
#
# Expected: mean visibility 0.7500
#
# The program is $PENUMBRA, or else `penumbra` on the path; pictures go to a temporary folder.
set -eu
examples=$(cd "$(dirname "$0")" && pwd)
penumbra=${PENUMBRA:-penumbra}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$penumbra" mask "$examples/square.json" -o "$work/mask.pfm"
"$penumbra" mask "$examples/square.json" -o "$work/reference.pfm" --technique ray_traced --set samples=64
"$penumbra" compare "$work/mask.pfm" "$work/reference.pfm"

# A PFM file ends in its pixels: 256 x 256 float32.
tail -c $((256 * 256 * 4)) "$work/mask.pfm" | od -An -v -tf4 |
    LC_ALL=C awk '{ for (i = 1; i <= NF; i++) { sum += $i; count++ } } END { printf "mean visibility %.4f\n", sum / count }'
