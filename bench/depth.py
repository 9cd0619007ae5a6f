#!/usr/bin/python3
"""How near to the truth are masks from depth images that other programs made?

    bench/depth.py PENUMBRA OUT [--scene bunny|room] [--only NAME,...] [--techniques KIND,...] [--quick] [--pictures FILE.png]

Renders a camera's depth of two scenes of meshes, changes it as renderers, formats, networks and sensors do, and uses each image twice:

    receivers  the image is shaded; the true meshes cast
    relit      the image is all there is: it casts and it is shaded

Prints Markdown. A cell compares with 1024 shadow rays on the true meshes, what the camera did not see included:

    mean error over pixels in shadow (below .999 in either mask) / lit pixels that are darker than .9 /
    dark pixels (below .1) that are brighter than .3 / isolated pixels (.35 from the median of 3 x 3 pixels, where the truth's are not)

`inside` is the share of pixels whose truth lies within the limits of `--bound`, or .05 beside them. Pixels whose changed depth belongs to
another surface are left out. --only takes a part of the names of rows. PENUMBRA is the program, OUT a folder for its files.

Needs Debian's python3-numpy, python3-openimageio and, for the bunny, glmark2-data."""
import argparse
import json
import pathlib
import subprocess
import sys

import numpy as np
import OpenImageIO as oiio

WIDTH, HEIGHT = 480, 270
FINE = 4  # the finer depth has FINE x FINE samples a pixel
BUNNY = "/usr/share/glmark2/models/bunny.obj"
QUICK = ("clean", "noise 1e-3", "16-bit window")


# Scenes: objects, camera, light.


def box(low, high):
    """A closed box of twelve triangles, facing outwards."""
    points = [[(low, high)[i >> axis & 1][axis] for axis in range(3)] for i in range(8)]
    sides = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    return points, [three for a, b, c, d in sides for three in ((a, b, c), (a, c, d))]


def ball(center, radius, steps=32):
    """A sphere of 2 steps x steps quads."""
    polar, around = np.meshgrid(np.linspace(0, np.pi, steps + 1), np.arange(2 * steps) * np.pi / steps, indexing="ij")
    unit = np.stack([np.sin(polar) * np.cos(around), np.cos(polar), np.sin(polar) * np.sin(around)], -1).reshape(-1, 3)
    faces = []
    for i in range(steps):
        for k in range(2 * steps):
            a, b = 2 * steps * i + k, 2 * steps * i + (k + 1) % (2 * steps)
            faces += [(a, b, b + 2 * steps), (a, b + 2 * steps, a + 2 * steps)]
    return (np.array(center) + radius * unit).tolist(), faces


def write_mesh(path, bodies):
    lines, first = [], 1
    for points, faces in bodies:
        lines += ["v %.7g %.7g %.7g" % tuple(p) for p in points]
        lines += ["f %d %d %d" % tuple(first + i for i in face) for face in faces]
        first += len(points)
    path.write_text("\n".join(lines) + "\n")


def ground(center, half_u, half_v):
    """A floor or a wall."""
    return {"quad": {"center": center, "half_u": half_u, "half_v": half_v}}


def lamp(center, target, half):
    """A square light at `center` that shines towards `target`, along cross(half_v, half_u)."""
    along = np.subtract(target, center) / np.linalg.norm(np.subtract(target, center))
    u = np.cross(along, (0, 1, 0))
    u /= np.linalg.norm(u)
    return {"kind": "rectangle", "center": center, "half_u": (half * u).tolist(), "half_v": (half * np.cross(u, along)).tolist()}


def looking(eye, target, degrees):
    return {"kind": "pinhole", "eye": eye, "target": target, "vertical_fov_deg": degrees}


def bunny(_):
    foot = min(float(line.split()[2]) for line in open(BUNNY) if line.startswith("v "))
    objects = [{"mesh": BUNNY, "translate": [0, -foot, 0]}, ground([0, 0, 0], [24, 0, 0], [0, 0, -24])]
    return objects, looking([-0.6, 3.4, 4.6], [0.3, 0.6, 0], 30), lamp([-3, 4.5, 2.5], [0, 0.6, 0], 0.4)


def room(folder):
    legs = [box((x - 0.06, 0, z - 0.06), (x + 0.06, 0.95, z + 0.06)) for x in (-0.9, 0.9) for z in (-0.5, 0.5)]
    write_mesh(folder / "table.obj", [box((-1, 0.95, -0.6), (1, 1.05, 0.6)), ball((0.35, 1.4, 0), 0.35)] + legs)
    objects = [{"mesh": "table.obj"}, ground([0, 0, 0], [6, 0, 0], [0, 0, -6]),
               ground([0, 3, -2], [6, 0, 0], [0, 3, 0]), ground([-2.4, 3, 0], [0, 0, -6], [0, 3, 0])]
    return objects, looking([2.6, 2.7, 4.6], [-0.3, 0.8, -0.3], 40), lamp([1.8, 4, 2.6], [0, 0.8, -0.2], 0.35)


SCENES = {"bunny": bunny, "room": room}


# Images.


def load(path):
    source = oiio.ImageInput.open(str(path))
    spec = source.spec()
    pixels = np.asarray(source.read_image("float"), np.float64).reshape(spec.height, spec.width, -1)
    source.close()
    return pixels


def save(path, pixels, kind="float", channels=("Z",)):
    height, width = pixels.shape[:2]
    spec = oiio.ImageSpec(width, height, len(channels), kind)
    spec.channelnames = channels
    target = oiio.ImageOutput.create(str(path))
    target.open(str(path), spec)
    target.write_image(np.ascontiguousarray(pixels.reshape(height, width, len(channels)).astype(np.float32 if kind in ("float", "half") else kind)))
    target.close()


def blurred(image, deviation):
    reach = int(np.ceil(4 * deviation))
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / deviation) ** 2)
    line = lambda row: np.convolve(np.pad(row, reach, "edge"), weights / weights.sum(), "valid")
    return np.apply_along_axis(line, 1, np.apply_along_axis(line, 0, image))


# Variants: what other programs make of the same depth.


def variants(depth, fine):
    """name -> (pixels, type, encoding, depth of the pixels as it is then known)."""
    random = np.random.default_rng(13)
    normal = random.standard_normal(depth.shape)
    blocks = fine.reshape(HEIGHT, FINE, WIDTH, FINE)
    y, x = np.indices(depth.shape)
    anywhere = blocks[y, random.integers(0, FINE, depth.shape), x, random.integers(0, FINE, depth.shape)]
    corners = blocks[:, ::FINE // 2, :, ::FINE // 2]
    near, far = 1, 50
    window = {"kind": "window", "near": near, "far": far}
    steps = np.round(65535 * (1 / near - 1 / depth) / (1 / near - 1 / far))
    # A depth camera drops single pixels, and bands along edges, where the two sides see different things.
    jump = np.maximum(abs(np.gradient(depth, axis=0)), abs(np.gradient(depth, axis=1))) > 0.03 * depth
    dropped = jump | (random.random(depth.shape) < 0.02)
    metres = np.where(dropped, np.nan, np.round(1000 * depth) / 1000)

    floats = lambda changed: (changed, "float", {}, changed)
    yield "clean", floats(depth)
    yield "x (1 + 4e-6)", floats(depth * (1 + 4e-6))
    yield "anywhere in the pixel", floats(anywhere)
    yield "half float", (depth, "half", {}, depth)
    for share in ("1e-6", "1e-4", "1e-3", "1e-2"):
        yield "noise " + share, floats(depth * (1 + float(share) * normal))
    yield "anti-aliased 2 x 2", floats(corners.mean((1, 3)))
    yield "smeared by 1.5 pixels", floats(1 / blurred(1 / depth, 1.5))
    yield "16-bit window", (steps, "uint16", window, depth)
    yield "millimetres, holes", (np.nan_to_num(1000 * metres), "uint16", {"kind": "planar", "scale": 0.001, "empty": 0}, metres)


# Measuring.


def isolated(image):
    around = np.pad(image, 1, "edge")
    return abs(image - np.median([around[j:j + HEIGHT, i:i + WIDTH] for j in range(3) for i in range(3)], axis=0)) > 0.35


def figures(mask, truth, counts):
    error = mask - truth
    share = lambda some, of: 100 * (some & of).sum() / max(1, of.sum())
    return "%.3f / %.1f %% / %.1f %% / %d" % (
        abs(error[counts & (np.minimum(mask, truth) < 0.999)]).mean(),
        share(mask < 0.9, counts & (truth >= 0.999)),
        share(mask > 0.3, counts & (truth < 0.1)),
        (counts & isolated(mask) & ~isolated(truth)).sum())


class Study:
    def __init__(self, program, folder):
        self.program, self.folder = program, folder

    def run(self, verb, name, scene, *words):
        """What went wrong, or nothing."""
        (self.folder / (name + ".json")).write_text(json.dumps(scene, indent=1))
        done = subprocess.run([self.program, verb, name + ".json", *words], cwd=self.folder, capture_output=True, text=True)
        return (done.stderr.strip().splitlines() or ["failed"])[-1] if done.returncode else ""

    def must(self, *words):
        if failed := self.run(*words):
            sys.exit("bench/depth.py: " + failed)

    def mask(self, scene, technique, bound=False):
        """A mask, the limits of each pixel where they are asked for, and what went wrong."""
        words = ["-o", "mask.exr", "--technique", technique]
        if technique == "ray_traced":
            words += ["--set", "samples=64"]
        if bound:
            words += ["--bound", "bound.exr"]
        failed = self.run("mask", "mask", scene, *words)
        if failed:
            return None, None, failed
        # Readers order an EXR's channels as they like: the lower of the two is the lower limit.
        limits = np.sort(load(self.folder / "bound.exr"), axis=-1) if bound else None
        return load(self.folder / "mask.exr")[..., 0], limits, ""


def prepared(name, program, out):
    folder = out / name
    folder.mkdir(parents=True, exist_ok=True)
    study = Study(program, folder)
    objects, camera, light = SCENES[name](folder)
    scene = {"penumbra": 1, "light": light, "objects": objects,
             "occluders": {"resolution": [512, 512]},
             "receivers": {"camera": camera, "resolution": [WIDTH, HEIGHT]}}
    finer = dict(scene, receivers={"camera": camera, "resolution": [FINE * WIDTH, FINE * HEIGHT]})
    study.must("mask", "truth", scene, "-o", "truth.exr", "--technique", "ray_traced", "--set", "samples=1024")
    study.must("depth", "seen", scene, "--out", "seen", "--technique", "soft_shadow_volume")
    study.must("depth", "finer", finer, "--out", "finer", "--technique", "soft_shadow_volume")
    read = lambda path: load(folder / path)[..., 0]
    truth, depth, fine = read("truth.exr"), read("seen/receiver.exr"), read("finer/receiver.exr")
    if not (np.isfinite(depth).all() and np.isfinite(fine).all()):
        sys.exit("bench/depth.py: %s: the camera sees nothing in places; its scene must fill the image" % name)
    return study, scene, camera, truth, depth, fine


def view_of(study, camera, name, pixels, kind, encoding):
    path = "".join(c if c.isalnum() else "_" for c in name) + (".png" if kind == "uint16" else ".exr")
    save(study.folder / path, pixels, kind, ("Y",) if kind == "uint16" else ("Z",))
    return dict({"camera": camera, "depth": path}, **({"encoding": encoding} if encoding else {}))


def relit(scene, view):
    return dict(scene, objects=[view], receivers=view)


def measure(name, given):
    study, scene, camera, truth, depth, fine = prepared(name, given.penumbra, given.out)
    rows = {"receivers": [], "relit": []}
    for row, (pixels, kind, encoding, known) in variants(depth, fine):
        if (given.only and not any(part in row for part in given.only.split(","))) or (given.quick and row not in QUICK):
            continue
        print("%s: %s" % (name, row), file=sys.stderr, flush=True)
        view = view_of(study, camera, row, pixels, kind, encoding)
        counts = abs(known / depth - 1) < 0.06
        for use, used in (("receivers", dict(scene, receivers=view)), ("relit", relit(scene, view))):
            cells = []
            for technique in given.techniques.split(","):
                bound = use == "relit" and technique == "depth_trace"
                mask, limits, failed = study.mask(used, technique, bound)
                cells.append(failed[:80] or figures(mask, truth, counts))
                if bound:
                    low_high = not failed and (truth >= limits[..., 0] - 0.05) & (truth <= limits[..., 1] + 0.05)
                    cells.append("-" if failed else "%.1f %%" % (100 * low_high[counts].mean()))
            rows[use].append([row] + cells)
    for use, lines in rows.items():
        heads = ["depth"]
        for technique in given.techniques.split(","):
            heads += [technique, "inside"] if use == "relit" and technique == "depth_trace" else [technique]
        print("\n**%s, %s**\n" % (name, use))
        for line in [heads, ["---"] * len(heads)] + lines:
            print("| " + " | ".join(line) + " |", flush=True)


def picture(given):
    """A row a scene: its depth with noise of 1e-3 as grey, the mask of that depth alone, the truth."""
    strips = []
    for name in given.scenes:
        study, scene, camera, truth, depth, fine = prepared(name, given.penumbra, given.out)
        noisy, kind, encoding, _ = dict(variants(depth, fine))["noise 1e-3"]
        mask, _, failed = study.mask(relit(scene, view_of(study, camera, "noisy", noisy, kind, encoding)), "depth_trace")
        if failed:
            sys.exit("bench/depth.py: " + failed)
        near, far = 1 / noisy.min(), 1 / noisy.max()
        strips.append(np.hstack([(1 / noisy - far) / (near - far), mask, truth]))
    save(given.pictures.resolve(), np.round(255 * np.clip(np.vstack(strips), 0, 1)), "uint8", ("Y",))


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("penumbra", type=lambda p: str(pathlib.Path(p).resolve()))
    words.add_argument("out", type=lambda p: pathlib.Path(p).resolve())
    words.add_argument("--scene", choices=SCENES)
    words.add_argument("--only", default="")
    words.add_argument("--techniques", default="depth_trace,ray_traced,soft_shadow_map,soft_shadow_volume")
    words.add_argument("--quick", action="store_true", help="a few rows")
    words.add_argument("--pictures", type=pathlib.Path, help="make the picture instead of the tables")
    given = words.parse_args()
    given.scenes = [given.scene] if given.scene else list(SCENES)
    if given.pictures:
        return picture(given)
    for name in given.scenes:
        measure(name, given)


if __name__ == "__main__":
    main()
