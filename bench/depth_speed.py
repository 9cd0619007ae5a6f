#!/usr/bin/python3
"""What does the mask of one depth image cost?

    bench/depth_speed.py PENUMBRA OUT [--repeat 3]

The room of bench/depth.py, 1280 x 720, clean: the image is all there is. 64 rays a pixel. Prints Markdown; times are medians, of the report's stages:

    fit    planes, edges, thickness of the image that casts; of the receivers it is the same image and costs nothing more
    map    the light's view of the image, for techniques that take maps
    shade  the mask

`mesh` is what people do without penumbra's walk: two triangles between four pixels that lie within 3 % of one another, traced by Embree.
The error is the mean over pixels in shadow, against 1024 rays on the true meshes. Needs what bench/depth.py needs."""
import argparse
import json
import pathlib
import statistics
import sys

import numpy as np

import depth

depth.WIDTH, depth.HEIGHT, depth.FINE = 1280, 720, 1
SAMPLES = 64


def write_ply(path, camera, z):
    """The image as a mesh, in the world."""
    eye, target = np.array(camera["eye"]), np.array(camera["target"])
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross((0, 1, 0), back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    tangent = np.tan(np.radians(camera["vertical_fov_deg"]) / 2)
    height, width = z.shape
    x = (2 * np.arange(width) + 1 - width) / height * tangent
    y = (height - 1 - 2 * np.arange(height)) / height * tangent
    points = eye + z[..., None] * (x[None, :, None] * right + y[:, None, None] * up - back)
    index = np.arange(width * height).reshape(height, width)
    corners = [index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]]
    depths = np.stack([z.ravel()[c] for c in corners])
    joined = depths.max(0) < 1.03 * depths.min(0)
    a, b, c, d = (corner[joined] for corner in corners)
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    records = np.empty(len(faces), [("count", "u1"), ("corners", "<i4", 3)])
    records["count"], records["corners"] = 3, faces
    with open(path, "wb") as out:
        out.write(("ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
                   "element face %d\nproperty list uchar int vertex_indices\nend_header\n" % (z.size, len(faces))).encode())
        out.write(points.reshape(-1, 3).astype("<f4").tobytes())
        out.write(records.tobytes())


def timed(study, scene, technique, repeat):
    """Medians of the stages' milliseconds, and the mask."""
    stages = []
    for _ in range(repeat):
        words = ["-o", "mask.exr", "--technique", technique, "--report", "report.json"]
        study.must("mask", "speed", scene, *words, *(["--set", "samples=%d" % SAMPLES] if "trace" in technique else []))
        report = json.loads((study.folder / "report.json").read_text())
        one = {stage["name"]: stage["ms"] for stage in report["stages"]}
        stages.append({"fit": one.get("fit depth", 0), "map": one.get("render depth", 0), "shade": report["shade_ms"]})
    return {key: statistics.median(s[key] for s in stages) for key in stages[0]}, depth.load(study.folder / "mask.exr")[..., 0]


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("penumbra", type=lambda p: str(pathlib.Path(p).resolve()))
    words.add_argument("out", type=lambda p: pathlib.Path(p).resolve())
    words.add_argument("--repeat", type=int, default=3)
    given = words.parse_args()
    study, scene, camera, truth, z, _ = depth.prepared("room", given.penumbra, given.out)
    view = depth.view_of(study, camera, "clean", z, "float", {})
    write_ply(study.folder / "image.ply", camera, z)
    relit = depth.relit(scene, view)
    mesh = dict(relit, objects=[{"mesh": "image.ply"}])
    rows = [("depth_trace", "image", relit), ("ray_traced", "image", relit), ("ray_traced", "mesh", mesh),
            ("soft_shadow_map", "image", relit), ("shadow_map", "image", relit)]
    print("| technique | casts | fit | map | shade | million rays a second | mean error |\n| --- | --- | --- | --- | --- | --- | --- |")
    for technique, what, used in rows:
        times, mask = timed(study, used, technique, given.repeat)
        rays = "%.0f" % (z.size * SAMPLES / times["shade"] / 1000) if "trace" in technique else "-"
        error = abs(mask - truth)[np.minimum(mask, truth) < 0.999].mean()
        times = {key: "%.0f ms" % ms if ms else "-" for key, ms in times.items()}
        print("| %s | %s | %s | %s | %s | %s | %.3f |" % (technique, what, times["fit"], times["map"], times["shade"], rays, error), flush=True)


if __name__ == "__main__":
    sys.exit(main())
