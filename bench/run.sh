#!/bin/sh
# Runs benches, writes out/bench/NAME.csv and, when gnuplot is there, the plots of docs/pictures.
#     bench/run.sh [BENCH...]     all of them without arguments: about an hour on two cores, of which the suite takes half
# Needs a build: cmake --preset release && cmake --build --preset release
set -eu
cd "$(dirname "$0")/.."
bench=${PENUMBRA_BENCH:-build/release/bench/penumbra_bench}
[ -x "$bench" ] || { echo "bench/run.sh: $bench is missing: build first (./check builds it)" >&2; exit 2; }
mkdir -p out/bench docs/pictures
[ $# -gt 0 ] || set -- limits image_io suite bunny baselines texels accumulators resolution light_size lateral vertical large wedges wedge_culling wedge_models wedge_silhouettes wedge_growth smoothies smoothie_light_size occlusion occlusion_filters occlusion_light occlusion_casters occlusion_sheet
for name in "$@"; do
    echo "bench $name" >&2
    "$bench" "$name" > "out/bench/$name.csv.part"
    mv "out/bench/$name.csv.part" "out/bench/$name.csv"
done
echo "bench startup" >&2
bench/startup.sh > out/bench/startup.md
if command -v gnuplot > /dev/null; then
    gnuplot -e "csv='out/bench'; out='docs/pictures'" bench/plots.gp || echo "bench/run.sh: some plots lack their CSV" >&2
fi
