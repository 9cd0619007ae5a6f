#!/bin/sh
# 07: the shadow of foliage: slices of a tree held against shadow rays.
#
# Expected: mean error 0.027
#
# 07_foliage_tree.py makes a tree of 4000 leaves; in 07_foliage.json it stands on a floor under a square light. Each line is a mask of the floor
# alone, against 1024 rays a pixel: mean error and bias over what lies in shadow. The number is the default's: 16 slices, layers of them summed, the
# greatest of the layers. The paper's product is too dark here, the sum darker still, the greatest slice far too bright. The last lines have the tree's
# own shadows on itself as well: there slices are coarse.
#
# The program is $PENUMBRA, or else `penumbra` on the path; pictures go to a temporary folder, or to the one given as argument.
set -eu
examples=$(cd "$(dirname "$0")" && pwd)
penumbra=${PENUMBRA:-penumbra}
work=${1:-$(mktemp -d)}
[ $# -gt 0 ] || trap 'rm -rf "$work"' EXIT

python3 "$examples/07_foliage_tree.py" "$work/tree.obj"
cp "$examples/07_foliage.json" "$work/tree.json"
# The floor alone is shaded.
sed 's/"tree.obj"/"tree.obj", "receives": false/' "$work/tree.json" > "$work/floor.json"

# error SCENE SETTING...: mean error and bias of a mask against SCENE's rays
error() {
    scene=$1
    shift
    "$penumbra" mask "$work/$scene.json" -o "$work/mask.exr" "$@" 2> "$work/warnings" || { cat "$work/warnings" >&2; exit 1; }
    "$penumbra" compare "$work/mask.exr" "$work/$scene.rays.exr" --json |
        sed 's/.*"mae_shadow":\([^,]*\),.*"bias_shadow":\([^,]*\),.*/\1 \2/' |
        { read -r mean bias; printf '%-6s %6.3f %+6.3f  %s\n' "$scene" "$mean" "$bias" "$*"; }
}

for scene in floor tree; do
    "$penumbra" mask "$work/$scene.json" -o "$work/$scene.rays.exr" --technique ray_traced --set samples=1024
done
for combine in product layered_max layered sum max; do error floor --set combine=$combine; done
for slices in 4 8 32 64; do error floor --set slices=$slices; done
error floor --set light_splits=2
error floor --set prefilter=summed_area
error floor --technique soft_shadow_map
error floor --technique soft_shadow_volume
for self in fade own omit; do error tree --set self_shadow=$self; done
error tree --set slices=64 --set self_shadow=own
error floor | awk '{ print "mean error", $2 }'
