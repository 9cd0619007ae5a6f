"""05: depth maps as arrays to a service, masks back as arrays; a scene that is sent once and lit many times.

    PYTHONPATH=clients/python python3 examples/05_service.py http://127.0.0.1:8080
"""

import sys

from penumbra_client import Client

SIDE = 256
camera = {"kind": "light", "tan_half_fov": [0.5, 0.5]}
scene = {
    "penumbra": 1,
    "light": {"kind": "rectangle", "center": [0, 6, 0], "half_u": [0.5, 0, 0], "half_v": [0, 0, -0.5]},
    "occluders": {"camera": camera, "depth": {"front": "front"}},
    "receivers": {"camera": camera, "depth": "floor"},
    "technique": {"kind": "soft_shadow_map", "sides": "front"},
}

# What the light sees: a square of half-edge 1 at depth 4, a floor at depth 6. At depth 4 the map is 4 wide, so the square is half of it.
# Nested lists do; numpy arrays of shape (height, width) are the usual thing.
nothing = float("inf")
inside = range(SIDE // 4, SIDE * 3 // 4)
front = [[4.0 if x in inside and y in inside else nothing for x in range(SIDE)] for y in range(SIDE)]
floor = [[6.0] * SIDE for _ in range(SIDE)]

client = Client(sys.argv[1])
with client.keep(scene, {"front": front, "floor": floor}) as kept:
    for half in (0.25, 0.5):
        mask = kept.mask(light={"half_u": [half, 0, 0], "half_v": [0, 0, -half]})
        mean = sum(memoryview(mask.pixels).cast("B").cast("f")) / SIDE ** 2  # mask.pixels.mean() with numpy; this needs none
        print(f"light of half-edge {half}: {len(mask.warnings)} warnings, {sum(mask.timings.values()):.1f} ms in the service")
print(f"mean visibility {mean:.4f}")
