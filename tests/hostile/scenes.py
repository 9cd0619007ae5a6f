"""Random scenes with numbers at the ends of what there is: from one seed and number always the same."""

import math
import random
import struct

from bombs import pfm, png

LENGTHS = [0, 1e-12, 1e-6, 1e-3, 0.5, 1, 3, 1e3, 1e6, 1e12]
BEYOND = [1e12 * (1 + 2**-50), 1e13, 1e38, 1e39, 1e308, -1e13, -1e308, float("nan"), float("inf"), float("-inf"), "NaN", "1", "-inf", None, True, [], [1], {}]
INFINITE = math.inf


class Maker:
    def __init__(self, techniques, seed, number):
        self.random = random.Random(f"{seed} {number}")
        self.techniques = techniques
        self.parts = {}
        # How often a number is extreme, and how often none at all. Most scenes hold few: else none would be taken.
        self.extreme = self.random.choice([0, 0.02, 0.1, 0.5])
        self.wrong = self.random.choice([0, 0, 0, 0, 0.01, 0.05])

    # --- Values ---

    def odds(self, share):
        return self.random.random() < share

    def number(self, low, high):
        if self.odds(self.wrong):
            return self.random.choice(BEYOND)
        if self.odds(self.extreme):
            value = self.random.choice(LENGTHS) * self.random.choice([1, 1, -1, 1 + 2**-20, 1 - 2**-24])
            return value
        return self.random.uniform(low, high)

    def positive(self, low, high):
        value = self.number(low, high)
        return abs(value) if isinstance(value, float) and not self.odds(self.wrong) else value

    def vector(self, size=2):
        return [self.number(-size, size) for _ in range(3)]

    def direction(self):
        if self.odds(self.wrong):
            return self.random.choice([[0, 0, 0], [1e-30, 0, 0], [0, 1e-320, 0]])
        return self.random.choice([[0, -1, 0], [0, -1, 0], [0, 1, 0], [1, 0, 0], [1e-12, -1, 0], [1e12, -1e12, 1], self.vector(1)])

    def side(self):
        return self.random.choice([1, 1, 2, 3, 7, 16, 31, 32, 64])

    def resolution(self):
        if self.odds(self.wrong):
            return self.random.choice([[0, 1], [-1, 4], [65537, 1], [65536, 65536], [1.5, 2], [1], "64", None])
        return self.random.choice([[self.side(), self.side()], [1, 1], [1, 512], [512, 1]]) if self.odds(0.3) else [32, 32]

    # --- Parts ---

    def depths(self, count):
        """Of one map."""
        kind = self.random.choice(["flat", "flat", "two", "two", "noise", "slope", "empty", "extreme", "wild"])
        near = self.random.choice([1.0, 2.0, 4.0, 6.0])
        if kind == "flat":
            return [near] * count
        if kind == "two":
            return [self.random.choice([near, INFINITE]) for _ in range(count)]
        if kind == "noise":
            return [near + self.random.random() for _ in range(count)]
        if kind == "slope":
            return [near + 3 * i / count for i in range(count)]
        if kind == "empty":
            return [self.random.choice([INFINITE, 0.0, -1.0, float("nan")])] * count
        if kind == "extreme":
            value = self.random.choice([1e-38, 1e-12, 1e-6, 1e6, 9.9e8, 1e9, 3e38])
            return [self.random.choice([value, near]) for _ in range(count)]
        return [struct.unpack("<f", struct.pack("<I", self.random.getrandbits(32)))[0] for _ in range(count)]

    def image(self, name, size=None):
        width, height = size or (self.side(), self.side())
        if self.odds(self.wrong):
            self.parts[name] = self.random.choice([b"", b"P", pfm(4, 4, 1.0)[:-7], png(3, 3)[:40], b"Pf\n-1 4\n-1.0\n"])
        elif self.odds(0.15):
            self.parts[name] = png(width, height, self.random.choice([0, 1, 30000, 65535]))
        else:
            self.parts[name] = pfm(width, height, self.depths(width * height))
        return name

    def encoding(self):
        kind = self.random.choice(["planar"] * 6 + ["radial", "disparity", "window", "reversed_window", "normalized"])
        encoding = {"kind": kind}
        if kind in ("window", "reversed_window", "normalized"):
            encoding.update(near=self.positive(0.1, 1), far=self.positive(2, 9))
        if self.odds(0.1):
            encoding["scale"] = self.number(-2, 2)
        if self.odds(0.1):
            encoding["empty"] = self.number(0, 10)
        if self.odds(0.1):
            encoding["precision"] = self.positive(1e-9, 1e-2)
        return encoding

    # --- Sections ---

    def light(self, textured=True):
        kind = self.random.choice(["rectangle", "rectangle", "sphere", "point", "directional"])
        place = self.random.choice([[0, 6, 0], [0, 6, 0], [0, 0, 0], [0, 2, 0], self.vector(4)])
        if kind == "rectangle":
            u, v = self.positive(0, 1), self.positive(0, 1)
            light = {"kind": kind, "center": place, "half_u": [u, 0, 0], "half_v": [0, 0, -v] if isinstance(v, float) else [0, 0, v]}
            if self.odds(0.1):
                light.update(half_u=self.vector(), half_v=self.vector())
            if textured and self.odds(0.1):
                light["emission"] = self.image("emission.pfm")
            return light
        if kind == "sphere":
            return {"kind": kind, "center": place, "radius": self.positive(0, 1)}
        if kind == "point":
            return {"kind": kind, "center": place, "direction": self.direction()}
        diameter = self.random.choice([0, 0.53, 0.53, 30, 90, 179, 1e-12, self.positive(0, 90)])
        return {"kind": kind, "direction": self.direction(), "angular_diameter_deg": diameter}

    def pair(self, low, high):
        pair = [self.positive(low, high), self.positive(low, high)]
        return self.random.choice([pair, pair, pair[0], [1e-12, 1e4], 1e-6, 1e4]) if self.odds(self.extreme) else pair

    def light_camera(self, light):
        size = "half_extent" if light["kind"] == "directional" else "tan_half_fov"
        return {"kind": "light", size: self.pair(0.3, 1)}

    def camera(self, light):
        kind = self.random.choice(["light"] * 5 + ["fitted", "pinhole", "pinhole", "matrix"])
        if kind == "light":
            return self.light_camera(light)
        if kind == "fitted":
            return {"kind": "light"}
        if kind == "pinhole":
            fov = self.random.choice([60, 60, 1e-6, 1e-2, 179, 179.97, self.number(1, 170)])
            return {"kind": "pinhole", "eye": self.vector(5), "target": self.vector(1), "up": self.random.choice([[0, 1, 0], [0, 0, -1], self.direction()]), "vertical_fov_deg": fov}
        matrix = [1, 0, 0, 0, 0, 0, 1, 5, 0, -1, 0, 0, 0, 0, 0, 1]
        if self.odds(self.extreme):
            matrix[self.random.randrange(16)] = self.number(-1, 1)
        return {"kind": "pinhole", "world_from_camera": matrix, "tan_half_fov": self.pair(0.3, 1)}

    def placed(self, thing):
        if self.odds(0.3):
            thing["scale"] = self.positive(0.5, 2)
        if self.odds(0.3):
            thing["translate"] = self.vector()
        if self.odds(0.2):
            thing["rotate_deg"] = [self.number(-180, 180) for _ in range(3)]
        for role in ("casts", "receives"):
            if self.odds(0.3):
                thing[role] = self.odds(0.5)
        return thing

    def object(self, number):
        if self.odds(0.15):
            seen = {"depth": self.image(f"object{number}.pfm", (16, 16)), "camera": {"kind": "pinhole", "eye": self.vector(5), "target": [0, 0, 0], "up": [0, 0, -1], "vertical_fov_deg": 60}}
            if self.odds(0.3):
                seen["thickness"] = self.random.choice(["auto", self.positive(0, 1)])
            return self.placed(seen)
        height = self.random.choice([0, 0, 2, 3, 6])
        quad = {"center": [0, height, 0], "half_u": [self.positive(0.5, 4), 0, 0], "half_v": [0, 0, self.positive(-4, -0.5)]}
        if self.odds(0.15):
            quad = {"center": self.vector(), "half_u": self.vector(), "half_v": self.vector()}
        return self.placed({"quad": quad})

    def technique(self):
        one = self.random.choice(self.techniques)
        technique = {"kind": one["kind"]}
        small = {"samples": 16, "first_samples": 8, "resolution": 96, "slices": 8, "light_splits": 3, "table": 8, "project_resolution": 64, "taps": 9, "layers": 4, "corner_wedges": 8, "seed": 2**53}
        for key, schema in one["schema"]["properties"].items():
            if key == "kind" or not self.odds(0.3):
                if key == "samples":
                    technique[key] = 4
                continue
            if self.odds(self.wrong):
                technique[key] = self.random.choice(BEYOND)
            elif "enum" in schema:
                technique[key] = self.random.choice(schema["enum"])
            elif schema.get("type") == "boolean":
                technique[key] = self.odds(0.5)
            else:
                low, high = schema.get("minimum", 0), min(schema.get("maximum", 1e12), small.get(key, 1e12))
                whole = schema.get("type") == "integer"
                technique[key] = self.random.choice([low, high, self.random.randint(low, high) if whole else self.random.uniform(low, high)])
                if key == "table":
                    technique[key] -= technique[key] % 2
        return technique

    def views(self, section, role):
        size = (self.side(), self.side())
        if role == "occluders":
            section["depth"] = {"front": self.image("front.pfm", size)}
            if self.odds(0.3):
                section["depth"]["back"] = self.image("back.pfm", size)
            if self.odds(0.2):
                section["depth"]["layers"] = [self.image(f"layer{i}.pfm", size) for i in range(2)]
        else:
            section["depth"] = self.image("floor.pfm", size)
        if self.odds(0.4):
            section["encoding"] = self.encoding()

    def scene(self):
        scene = {"penumbra": 1, "light": self.light(), "technique": self.technique()}
        light = scene["light"]
        several = self.odds(0.05)
        if several:
            del scene["light"]
            scene["lights"] = [self.light(False) for _ in range(self.random.choice([1, 2, 3]))]
            light = scene["lights"][0]
        given = self.odds(0.4)
        if not given or scene["technique"]["kind"] == "ray_traced" or self.odds(0.3):
            scene["objects"] = [self.object(i) for i in range(self.random.choice([1, 2, 2, 3]))]
            if self.odds(0.8):
                scene["objects"].append({"quad": {"center": [0, 0, 0], "half_u": [4, 0, 0], "half_v": [0, 0, -4]}})
        for role in ("occluders", "receivers"):
            camera = self.camera(light) if role == "receivers" or self.odds(0.03) else self.light_camera(light)
            if several and role == "occluders" and not given:
                camera = {"kind": "light"}
            section = {"camera": camera}
            if given:
                self.views(section, role)
            else:
                section["resolution"] = self.resolution()
            scene[role] = section
        return scene

    def patch(self):
        self.parts = {}
        patch = {}
        light = {"kind": "rectangle"}
        if self.odds(0.6):
            patch["light"] = light = self.light(False)
        if self.odds(0.4):
            patch["technique"] = self.technique()
        if self.odds(0.3):
            patch["receivers"] = {"camera": self.camera(light), "resolution": self.resolution()}
        if self.odds(0.1):
            patch[self.random.choice(["objects", "output", "penumbra", "nothing", "lights"])] = self.random.choice([None, [], {}, 1, [self.light(False)]])
        return patch
