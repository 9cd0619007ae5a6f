"""Small requests that ask for much."""

import struct
import zlib


def png(width, height, value=0):
    """Grey of 16 bits, all alike: some 4 KB for 16 million texels, deflated twice as far as one thinks."""

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    packer = zlib.compressobj(9)
    row = b"\0" + struct.pack(">H", value) * width
    data = b"".join(packer.compress(row) for _ in range(height)) + packer.flush()
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0)) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def tiff(width, height, value=1.0):
    """Float32, deflate, one strip."""
    packer = zlib.compressobj(9)
    row = struct.pack("<f", value) * width
    data = b"".join(packer.compress(row) for _ in range(height)) + packer.flush()
    entries = [(256, 4, width), (257, 4, height), (258, 3, 32), (259, 3, 8), (262, 3, 1), (273, 4, 8), (277, 3, 1), (278, 4, height), (279, 4, len(data)), (339, 3, 3)]
    pad = len(data) % 2
    directory = struct.pack("<H", len(entries)) + b"".join(struct.pack("<HHII", tag, kind, 1, number) for tag, kind, number in entries) + struct.pack("<I", 0)
    return b"II*\0" + struct.pack("<I", 8 + len(data) + pad) + data + b"\0" * pad + directory


def exr_of_channels(count, side=1):
    """An EXR whose header names so many channels of 255 letters, without pixels."""

    def attribute(name, kind, data):
        return name + b"\0" + kind + b"\0" + struct.pack("<I", len(data)) + data

    names = (f"{i:08d}".encode() + b"a" * 240 for i in range(count))
    channels = b"".join(name + b"\0" + struct.pack("<IIII", 1, 0, 1, 1) for name in names) + b"\0"
    box = struct.pack("<iiii", 0, 0, side - 1, side - 1)
    header = b"".join([
        attribute(b"channels", b"chlist", channels), attribute(b"compression", b"compression", b"\0"), attribute(b"dataWindow", b"box2i", box),
        attribute(b"displayWindow", b"box2i", box), attribute(b"lineOrder", b"lineOrder", b"\0"), attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
        attribute(b"screenWindowCenter", b"v2f", struct.pack("<ff", 0, 0)), attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)), b"\0"])
    offset = 8 + len(header) + 8 * side
    row = struct.pack("<iI", 0, 2 * count * side) + b"\0" * (2 * count * side)
    return b"\x76\x2f\x31\x01" + struct.pack("<I", 2 | 0x400) + header + struct.pack("<Q", offset) * side + row


LIGHT = {"kind": "rectangle", "center": [0, 6, 0], "half_u": [0.5, 0, 0], "half_v": [0, 0, -0.5]}
CAMERA = {"kind": "light", "tan_half_fov": [0.5, 0.5]}


def quads(technique, side=64, receivers=64):
    """A square over a floor."""
    return {
        "penumbra": 1,
        "light": LIGHT,
        "objects": [
            {"quad": {"center": [0, 2, 0], "half_u": [1, 0, 0], "half_v": [0, 0, -1]}, "receives": False},
            {"quad": {"center": [0, 0, 0], "half_u": [4, 0, 0], "half_v": [0, 0, -4]}, "casts": False},
        ],
        "occluders": {"camera": CAMERA, "resolution": [side, side]},
        "receivers": {"camera": CAMERA, "resolution": [receivers, receivers]},
        "technique": technique,
    }


HONEST = quads({"kind": "soft_shadow_map", "sides": "front"})


def tables():
    return quads({"kind": "soft_shadow_volume", "coverage": "texture", "table": 64, "light_splits": 16}), {}


def splits():
    """One small PNG whose texels are casters, for 16 parts of the light."""
    scene = quads({"kind": "soft_shadow_volume", "light_splits": 4})
    del scene["objects"]
    scene["occluders"] = {"camera": CAMERA, "depth": {"front": "a.png"}, "encoding": {"kind": "normalized", "near": 1, "far": 3}}
    scene["receivers"] = {"camera": CAMERA, "depth": "b.png", "encoding": {"kind": "normalized", "near": 1, "far": 3}}
    return scene, {"a.png": png(2048, 2048, 30000), "b.png": png(64, 64, 60000)}


def layers(image, count=15, side=4096):
    scene = quads({"kind": "soft_shadow_map", "sides": "front"}, side)
    del scene["objects"]
    names = [f"layer{i}.tif" for i in range(count - 1)]
    scene["occluders"] = {"camera": CAMERA, "depth": {"front": names[0], "layers": names[1:]}}
    scene["receivers"] = {"camera": CAMERA, "depth": "floor.tif"}
    scene["technique"] = {"kind": "occlusion_texture"}
    return scene, {name: image for name in [*names, "floor.tif"]}


def depth_objects(image):
    scene = quads({"kind": "depth_trace", "samples": 1})
    camera = {"kind": "pinhole", "eye": [0, 5, 0], "target": [0, 0, 0], "up": [0, 0, -1], "vertical_fov_deg": 60}
    scene["objects"] = [{"depth": name, "camera": camera, "encoding": {"kind": "normalized", "near": 1, "far": 9}} for name in ("a.png", "b.png")]
    scene["receivers"] = {"camera": camera, "resolution": [64, 64]}
    return scene, {"a.png": image, "b.png": image}


def channels(count):
    scene = quads({"kind": "soft_shadow_map", "sides": "front"})
    scene["receivers"] = {"camera": CAMERA, "depth": "many.exr"}
    return scene, {"many.exr": exr_of_channels(count)}


def pfm(width, height, values):
    """Grey; one number for all, or a list of them."""
    numbers = [values] * (width * height) if isinstance(values, (int, float)) else values
    return f"Pf\n{width} {height}\n-1.0\n".encode() + struct.pack(f"<{width * height}f", *numbers)


def maps(side, number):
    """A scene of two float maps, unlike that of any other number."""
    scene = quads({"kind": "shadow_map"})
    del scene["objects"]
    scene["light"] = {**LIGHT, "center": [0, 6 + number / 1024, 0]}
    scene["occluders"] = {"camera": CAMERA, "depth": {"front": "front.pfm"}}
    scene["receivers"] = {"camera": CAMERA, "depth": "floor.pfm"}
    return scene, {"front.pfm": pfm(side, side, 2.0), "floor.pfm": pfm(side, side, 6.0)}


def endless(side, number=0):
    """Rays for minutes; how long they take nobody estimates."""
    scene, parts = maps(side, number)
    scene["technique"] = {"kind": "depth_trace", "samples": 16384}
    return scene, parts
