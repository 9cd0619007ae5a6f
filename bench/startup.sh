#!/bin/sh
# The first mask from a process start, in milliseconds: kernels compiled from nothing (cold), and from the cache (warm; the median of nine).
# Of the bunny's scene with its mesh, and of the same scene's depth maps alone.
#     bench/startup.sh        needs a build, as bench/run.sh does
set -eu
cd "$(dirname "$0")/.."
penumbra=${PENUMBRA_CLI:-build/release/clients/cli/penumbra}
[ -x "$penumbra" ] || { echo "bench/startup.sh: $penumbra is missing: build first (./check builds it)" >&2; exit 2; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$penumbra" depth examples/bunny.json --out "$folder/depth" > /dev/null

# ms COMMAND...: wall milliseconds of a command
ms() {
    start=$(date +%s%N)
    "$@"
    end=$(date +%s%N)
    echo $(((end - start) / 1000000))
}

echo '| scene | cold | warm |'
echo '| --- | --- | --- |'
for scene in examples/bunny.json "$folder/depth/scene.json"; do
    rm -rf "$folder/cache"
    export PENUMBRA_CACHE_DIR="$folder/cache"
    cold=$(ms "$penumbra" mask "$scene" -o "$folder/mask.exr")
    warm=$(for run in 1 2 3 4 5 6 7 8 9; do ms "$penumbra" mask "$scene" -o "$folder/mask.exr"; done | sort -n | sed -n 5p)
    case $scene in examples/*) name='bunny, mesh of 69,666 triangles' ;; *) name='bunny, depth maps alone' ;; esac
    echo "| $name | $cold | $warm |"
done
