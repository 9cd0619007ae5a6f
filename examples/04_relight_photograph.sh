#!/bin/sh
# 04, with a photograph: a new light in a picture whose depth was measured.
#
#     examples/04_relight_photograph.sh [FOLDER]
#
# Writes before.png, mask.png and after.png into FOLDER, or into a new temporary one that it names. The photograph is OpenCV's aloe, from Debian's
# package opencv-doc. It is used where it is installed, else fetched (96 MB). Without it the script says so and exits with 77.
#
# LIGHT="X Y Z" is the light's place, SAMPLES its rays a pixel. The camera is at the origin and looks along -Z; the pot is about 1.5 away.
# The program is $PENUMBRA, or else `penumbra` on the path.
set -eu
penumbra=${PENUMBRA:-penumbra}
samples=${SAMPLES:-64}
light=${LIGHT:--0.9 0.9 -0.4}
out=${1:-$(mktemp -d)}
mkdir -p "$out"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# The photograph, aloeL.jpg, and its disparity, aloeGT.png.
pictures=usr/share/doc/opencv-doc/examples/data
if [ -f "/$pictures/aloeL.jpg" ]; then
    pictures=/$pictures
else
    chmod 755 "$work"
    (cd "$work" && apt-get download opencv-doc && dpkg -x opencv-doc_*.deb .) > "$work/log" 2>&1 || {
        cat "$work/log" >&2
        echo "04_relight_photograph: needs Debian's package opencv-doc, which cannot be fetched here" >&2
        exit 77
    }
    pictures=$work/$pictures
fi
cp "$pictures/aloeL.jpg" "$pictures/aloeGT.png" "$work"

# A stored value is the disparity in pixels less 270, and 0 where it is not known. Disparity in pixels is focal length times baseline / depth:
# 3740 pixels x 0.16 = 598.4. So 1 / depth = value / 598.4 + 270 / 598.4. The image is 1110 pixels high: its angle is 2 atan(555 / 3740).
depth='"depth": "aloeGT.png",
      "camera": { "kind": "pinhole", "eye": [0, 0, 0], "target": [0, 0, -1], "up": [0, 1, 0], "vertical_fov_deg": 16.881698 },
      "encoding": { "kind": "disparity", "scale": 0.00167112, "shift": 0.45120321, "empty": 0 }'
# The light shines towards the plant: what lies behind a light's plane has no shadows.
center=$(echo "$light" | awk '{ printf "[%s, %s, %s]", $1, $2, $3 }')
direction=$(echo "$light" | awk '{ printf "[%g, %g, %g]", -$1, -0.1 - $2, -1.5 - $3 }')
cat > "$work/scene.json" << EOF
{
  "penumbra": 1,
  "light": { "kind": "sphere", "center": $center, "direction": $direction, "radius": 0.12 },
  "objects": [ { $depth } ],
  "receivers": { $depth },
  "technique": { "kind": "depth_trace", "samples": $samples }
}
EOF

oiiotool "$work/aloeL.jpg" -o "$out/before.png"
"$penumbra" mask "$work/scene.json" -o "$out/mask.png" --over "$work/aloeL.jpg" --preview "$out/after.png"
echo "$out: before.png, mask.png, after.png"
