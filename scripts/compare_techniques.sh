#!/usr/bin/env bash
# One scene by all techniques, side by side: docs/pictures/techniques.png. Prints the error of each as a Markdown table.
#     scripts/compare_techniques.sh        after a build; PENUMBRA names another penumbra
# Needs oiiotool, jq, and fc-match (fontconfig) with a sans-serif font for the labels.
set -euo pipefail
cd "$(dirname "$0")/.."

penumbra=${PENUMBRA:-build/release/clients/cli/penumbra}
scene=examples/bunny.json
out=out/techniques
picture=docs/pictures/techniques.png
mkdir -p "$out"

# The part of the 512 x 512 mask with the shadow in it, the height of a label, the room between.
width=264
height=240
window=${width}x$height+118+122
label=42
font=$(fc-match -f "%{file}" sans:bold=false || true)
gap=6

# mask NAME TECHNIQUE [KEY=VALUE...]
mask() {
    local name=$1 technique=$2 sets=()
    shift 2
    for set in "$@"; do sets+=(--set "$set"); done
    "$penumbra" mask "$scene" -o "$out/$name.exr" --technique "$technique" "${sets[@]}" 2>"$out/$name.log" || { cat "$out/$name.log" >&2; return 1; }
}

# cell NAME TITLE SECOND_LINE LOWER_PICTURE: label, mask, and below it the difference.
cell() {
    oiiotool --create "${width}x$label" 3 --fill:color=1,1,1 "${width}x$label" \
        --text:font="$font":x=4:y=17:size=15:color=0,0,0 "$2" --text:font="$font":x=4:y=36:size=13:color=0.3,0.3,0.3 "$3" -o "$out/label.tif"
    oiiotool "$out/$1.exr" --ch 0,0,0 --cut "$window" -d uint8 -o "$out/upper.tif"
    oiiotool "$4" --cut "$window" -d uint8 -o "$out/lower.tif"
    # --paste lays the first image over the second.
    oiiotool --create "${width}x$((label + 2 * height + 1))" 3 --fill:color=0.6,0.6,0.6 "${width}x$((label + 2 * height + 1))" \
        "$out/label.tif" --swap --paste +0+0 "$out/upper.tif" --swap --paste "+0+$label" \
        "$out/lower.tif" --swap --paste "+0+$((label + height + 1))" -o "$out/cell_$1.tif"
}

mask reference ray_traced samples=1024
oiiotool --create 512x512 3 --fill:color=1,1,1 512x512 --text:font="$font":x=135:y=190:size=15:color=0.8,0,0 "red: brighter than the rays" \
    --text:font="$font":x=135:y=220:size=15:color=0,0,0.9 "blue: darker than the rays" --text:font="$font":x=135:y=250:size=15:color=0,0,0 "full colour at 0.1" -o "$out/legend.tif"
cell reference "ray_traced" "1024 rays: the reference" "$out/legend.tif"

cells=("$out/cell_reference.tif")
echo "| technique | settings | MAE shadow | bias | largest |"
echo "| --- | --- | --- | --- | --- |"
while read -r name technique settings; do
    # shellcheck disable=SC2086
    mask "$name" "$technique" $settings
    "$penumbra" compare "$out/$name.exr" "$out/reference.exr" -o "$out/difference_$name.png" --json >"$out/$name.json"
    error=$(jq -r '.mae_shadow * 10000 | round / 10000' "$out/$name.json")
    cell "$name" "$technique" "${settings:-defaults}: off by $error" "$out/difference_$name.png"
    cells+=("$out/cell_$name.tif")
    jq -r --arg t "$technique" --arg s "$settings" 'def r: . * 10000 | round / 10000; "| \($t) | \($s) | \(.mae_shadow | r) | \(.bias_shadow | r) | \(.max | r) |"' \
        "$out/$name.json"
done <<'END'
rays ray_traced samples=64
soft_shadow_map soft_shadow_map
soft_shadow_volume soft_shadow_volume
occlusion_texture occlusion_texture
smoothie smoothie two_sided=false
smoothie_two_sided smoothie
shadow_map shadow_map
END

oiiotool "${cells[@]}" "--mosaic:pad=$gap" 4x2 -d uint8 --compression zip:9 -o "$picture"
