"""Writes the scenes behind the pictures of docs/smoothie_study.md into the current folder; that page says how the pictures are made of them."""
import json
import math


def cylinder(path, radius=0.5, height=2.0, n=96):
    with open(path, "w") as f:
        for y in (0, height):
            for k in range(n):
                f.write("v %r %r %r\n" % (radius * math.cos(2 * math.pi * k / n), y, radius * math.sin(2 * math.pi * k / n)))
        f.write("v 0 0 0\nv 0 %r 0\n" % height)
        for k in range(n):
            a, b, c, d = k + 1, (k + 1) % n + 1, n + (k + 1) % n + 1, n + k + 1
            f.write("f %d %d %d\nf %d %d %d\nf %d %d %d\nf %d %d %d\n" % (a, d, c, a, c, b, 2 * n + 1, a, b, 2 * n + 2, c, d))


def box(path, low, high):
    sides = [(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)]
    with open(path, "w") as f:
        for i in range(8):
            f.write("v %r %r %r\n" % tuple((high if i >> k & 1 else low)[k] for k in range(3)))
        for t in sides:
            f.write("f %d %d %d\n" % tuple(x + 1 for x in t))


def scene(name, meshes, light, texels, technique, camera, pixels, tangent=0.32, receive=False):
    objects = [{"mesh": mesh, "receives": receive} for mesh in meshes]
    objects.append({"quad": {"center": [0, 0, 0], "half_u": [6, 0, 0], "half_v": [0, 0, -6]}, "casts": False})
    with open(name, "w") as f:
        json.dump({"penumbra": 1, "light": light, "objects": objects,
                   "occluders": {"camera": {"kind": "light", "tan_half_fov": [tangent, tangent]}, "resolution": [texels, texels]},
                   "receivers": {"camera": camera, "resolution": [pixels, pixels]},
                   "technique": technique, "output": {"format": "png", "bits": 8}}, f)


def sphere(center, radius, direction):
    return {"kind": "sphere", "center": center, "radius": radius, "direction": direction}


def pinhole(eye, target, degrees):
    return {"kind": "pinhole", "eye": eye, "target": target, "up": [0, 1, 0], "vertical_fov_deg": degrees}


SMOOTHIE = {"smoothie": {"kind": "smoothie", "two_sided": False}, "two_sided": {"kind": "smoothie"}, "rays": {"kind": "ray_traced", "samples": 256}}

cylinder("cylinder.obj")
box("high.obj", (-0.7, 2.2, -0.5), (0.5, 2.5, 0.7))
box("low.obj", (-0.2, 0.6, -0.2), (1.2, 1.2, 1.2))
box("left.obj", (-2, 2.4, -0.2), (0.3, 2.6, 1.6))
box("right.obj", (-0.1, 1.4, -1.6), (2, 1.6, 0.3))

down = [-4, -7, -2]
for texels in (256, 512, 1024):
    for name, technique in (("1_hard", {"kind": "shadow_map"}), ("2_bicubic", {"kind": "shadow_map", "filter": "bicubic"}),
                            ("3_small", {"kind": "smoothie", "two_sided": False, "t_from": "t", "t": 0.05}), ("4_large", {"kind": "smoothie", "two_sided": False, "t_from": "t", "t": 0.2})):
        scene("resolution_%04d_%s.json" % (texels, name), ["cylinder.obj"], sphere([4, 7, 2], 0.1, down), texels, technique,
              pinhole([-1.9, 4.2, 1.6], [-1.15, 0, -0.3], 32), 320)
for radius in (0.1, 0.4, 0.8):
    for name in ("smoothie", "two_sided", "rays"):
        scene("light_%g_%s.json" % (radius, name), ["cylinder.obj"], sphere([4, 7, 2], radius, down), 1024, SMOOTHIE[name],
              pinhole([-2.2, 6, 4], [-0.8, 0, -0.3], 38), 384)
for name in ("smoothie", "rays"):
    scene("receivers_%s.json" % name, ["high.obj", "low.obj"], sphere([0.6, 7, 0.8], 0.6, [0, -1, 0]), 1024, SMOOTHIE[name],
          pinhole([2.6, 5.2, 5.2], [0.2, 0.6, 0.2], 36), 384, receive=True)
for name in ("smoothie", "two_sided", "rays"):
    scene("blockers_%s.json" % name, ["left.obj", "right.obj"], sphere([0, 7, 0], 0.5, [0, -1, 0]), 1024, SMOOTHIE[name],
          {"kind": "light", "tan_half_fov": [0.22, 0.22]}, 256)
