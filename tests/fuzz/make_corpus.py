#!/usr/bin/env python3
"""Makes corpus/<target>/: small sound files of every kind that the readers know, and some of kinds that they refuse.

The files are stored, so that the fuzzers' inputs stay the same; this says how they were made. Needs oiiotool (openimageio-tools).
Files that a fuzzer found stand beside them under names that begin with found_, and are kept.
"""
import base64
import json
import math
import pathlib
import struct
import subprocess
import tempfile
import zlib

HERE = pathlib.Path(__file__).parent
CORPUS = HERE / "corpus"


def put(target, name, data):
    folder = CORPUS / target
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(data.encode() if isinstance(data, str) else data)


def oiiotool(target, name, *arguments):
    folder = CORPUS / target
    folder.mkdir(parents=True, exist_ok=True)
    # From the folder itself: oiiotool writes its command line into the file, and no path of the machine is to stand there.
    subprocess.run(["oiiotool", *map(str, arguments), "-o", name], check=True, capture_output=True, cwd=folder)


# --- EXR, TIFF, HDR through OpenImageIO


def exr(folder):
    source = folder / "source.exr"
    grey = folder / "grey.exr"
    subprocess.run(["oiiotool", "--pattern", "noise:seed=1", "21x19", "4", "--chnames", "R,G,B,A", "-d", "float", "-o", source], check=True)
    subprocess.run(["oiiotool", source, "--ch", "R", "--chnames", "Z", "-d", "float", "-o", grey], check=True)
    for compression in ["none", "rle", "zips", "zip", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab"]:
        oiiotool("image_exr", f"depth_{compression}.exr", grey, "--compression", compression)
        oiiotool("image_exr", f"half_{compression}.exr", source, "--ch", "R,G,B", "-d", "half", "--compression", compression)
        oiiotool("image_exr", f"tiled_{compression}.exr", source, "-d", "half", "--compression", compression, "--tile", "16", "16")
    oiiotool("image_exr", "uint.exr", grey, "-d", "uint32", "--compression", "zip")
    oiiotool("image_exr", "mixed.exr", source, "-d", "R=half", "-d", "G=float", "-d", "B=uint32", "--compression", "piz")
    oiiotool("image_exr", "decreasing.exr", grey, "--attrib", "openexr:lineOrder", "decreasingY")
    oiiotool("image_exr", "random_tiles.exr", grey, "--tile", "8", "8", "--attrib", "openexr:lineOrder", "randomY")

    oiiotool("image_exr", "multi_part.exr", source, grey, "--siappendall")
    oiiotool("image_exr", "deep.exr", source, "--ch", "R,G,B,A,Z=0.5", "--deepen")
    oiiotool("image_exr", "deep_tiled.exr", source, "--ch", "R,G,B,A,Z=0.5", "--deepen", "--tile", "16", "16")
    oiiotool("image_exr", "cropped.exr", grey, "--crop", "8x8+2+3")
    oiiotool("image_exr", "shifted.exr", grey, "--origin", "+5-7", "--fullpixels")
    oiiotool("image_exr", "layers.exr", source, "--chnames", "view.R,view.G,view.B,view.Depth.Z")
    oiiotool("image_exr", "one_pixel.exr", "--create", "1x1", "1", "-d", "float")
    long_name = "n" * 200
    oiiotool("image_exr", "long_name.exr", grey, "--chnames", long_name)


def tiff(folder):
    source = folder / "source.exr"
    grey = folder / "grey.exr"
    for compression in ["none", "lzw", "zip", "packbits"]:
        for bits in ["uint8", "uint16", "float"]:
            oiiotool("image_tiff", f"{bits}_{compression}.tif", source, "--ch", "R,G,B", "-d", bits, "--compression", compression)
        oiiotool("image_tiff", f"tiled_{compression}.tif", grey, "-d", "float", "--compression", compression, "--tile", "16", "16")
    oiiotool("image_tiff", "planar.tif", source, "-d", "uint16", "--planarconfig", "separate")
    oiiotool("image_tiff", "planar_tiled.tif", source, "-d", "uint16", "--planarconfig", "separate", "--tile", "16", "16")
    oiiotool("image_tiff", "half.tif", source, "-d", "half", "--attrib", "tiff:half", "1")
    oiiotool("image_tiff", "uint32.tif", grey, "-d", "uint32")
    oiiotool("image_tiff", "double.tif", grey, "-d", "double")
    oiiotool("image_tiff", "int16.tif", grey, "-d", "int16")
    oiiotool("image_tiff", "predictor3.tif", grey, "-d", "float", "--compression", "zip", "--attrib", "tiff:predictor", "3")
    oiiotool("image_tiff", "pages.tif", grey, source, "--siappendall", "-d", "uint8")
    oiiotool("image_tiff", "turned.tif", grey, "-d", "uint8", "--orientation", "6")
    oiiotool("image_tiff", "jpeg.tif", source, "--ch", "R,G,B", "-d", "uint8", "--compression", "jpeg")
    oiiotool("image_tiff", "bits4.tif", grey, "-d", "uint4")
    oiiotool("image_tiff", "bits10.tif", grey, "-d", "uint10")
    oiiotool("image_tiff", "bits1.tif", grey, "-d", "uint1")
    oiiotool("image_tiff", "cmyk.tif", source, "-d", "uint8", "--attrib", "tiff:ColorSpace", "CMYK")
    for order in "<>":
        for big in [False, True]:
            name = ("big" if big else "plain") + ("_le" if order == "<" else "_be")
            put("image_tiff", name + ".tif", hand_tiff(order, big))
    put("image_tiff", "palette.tif", hand_tiff("<", False, photometric=3))
    put("image_tiff", "min_is_white.tif", hand_tiff("<", False, photometric=0))
    put("image_tiff", "two_strips.tif", hand_tiff("<", True, strips=2))
    put("image_tiff", "loop.tif", hand_tiff("<", False, loop=True))


def hand_tiff(order, big, photometric=1, strips=1, loop=False):
    """4 x 4 pixels of 16 bits; BigTIFF has 64-bit offsets and counts."""
    width = height = 4
    pixels = struct.pack(order + "16H", *range(0, 65536, 4096))
    offset = struct.Struct(order + ("Q" if big else "I"))
    header = (b"II" if order == "<" else b"MM") + (
        struct.pack(order + "HHHQ", 43, 8, 0, 16 + len(pixels)) if big else struct.pack(order + "HI", 42, 8 + len(pixels)))
    start = len(header)
    rows = height // strips
    entries = [(256, 4, [width]), (257, 4, [height]), (258, 3, [16]), (259, 3, [1]), (262, 3, [photometric]),
               (273, 4, [start + i * rows * width * 2 for i in range(strips)]), (277, 3, [1]), (278, 4, [rows]),
               (279, 4, [rows * width * 2] * strips)]
    if photometric == 3:
        entries.append((320, 3, [0] * 12))
    body, extra = b"", b""
    directory = start + len(pixels)
    size = (8 if big else 2) + len(entries) * (20 if big else 12) + offset.size
    for tag, kind, values in entries:
        data = struct.pack(order + str(len(values)) + ("I" if kind == 4 else "H"), *values)
        if len(data) > offset.size:
            place = offset.pack(directory + size + len(extra))
            extra += data
        else:
            place = data.ljust(offset.size, b"\0")
        body += struct.pack(order + "HH", tag, kind) + offset.pack(len(values)) + place
    count = struct.pack(order + ("Q" if big else "H"), len(entries))
    return header + pixels + count + body + offset.pack(directory if loop else 0) + extra


# --- PNG, by hand: every colour type and depth, interlaced or not


def png(width, height, bits, colour, interlaced, filters=True, extra=b"", pieces=1):
    channels = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}[colour]

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    passes = [(0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)] if interlaced else [(0, 0, 1, 1)]
    rows = b""
    for x0, y0, dx, dy in passes:
        columns = (width - x0 + dx - 1) // dx
        if columns <= 0:
            continue
        length = (columns * channels * bits + 7) // 8
        for y in range(y0, height, dy):
            # Filtered bytes, whatever samples they make.
            rows += bytes([y % 5 if filters else 0]) + bytes((7 * i + 3 * y) % (4 if colour == 3 else 256) for i in range(length))
    data = zlib.compress(rows)
    step = -(-len(data) // pieces)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, int(interlaced))) +
            (chunk(b"PLTE", bytes(range(12))) if colour == 3 else b"") + (chunk(extra[:4], extra[4:]) if extra else b"") +
            b"".join(chunk(b"IDAT", data[i:i + step]) for i in range(0, len(data), step)) + chunk(b"IEND", b""))


def pngs():
    depths = {0: [1, 2, 4, 8, 16], 2: [8, 16], 3: [2, 8], 4: [8, 16], 6: [8, 16]}
    for colour, sizes in depths.items():
        for bits in sizes:
            for interlaced in [False, True]:
                put("image_png", f"colour{colour}_{bits}{'_interlaced' if interlaced else ''}.png", png(13, 11, bits, colour, interlaced, colour != 3))
    put("image_png", "transparent_grey.png", png(5, 5, 16, 0, False, extra=b"tRNS\0\3"))
    put("image_png", "transparent_rgb.png", png(5, 5, 8, 2, True, extra=b"tRNS\0\1\0\2\0\3"))
    put("image_png", "transparent_palette.png", png(5, 5, 8, 3, False, False, extra=b"tRNS\0\x80"))
    put("image_png", "profile.png", png(5, 5, 8, 2, False, extra=b"iCCPname\0\0" + zlib.compress(bytes(132))))
    put("image_png", "text.png", png(5, 5, 8, 0, False, extra=b"zTXtkey\0\0" + zlib.compress(b"text")))
    put("image_png", "pieces.png", png(13, 11, 16, 6, True, pieces=9))
    put("image_png", "one_pixel.png", png(1, 1, 16, 0, False))


# --- PFM, HDR


def maps():
    values = [math.sin(i) for i in range(36)]
    for order, scale in [("<", "-1.0"), (">", "1.0")]:
        put("image_pfm", f"grey{scale}.pfm", f"Pf\n6 6\n{scale}\n".encode() + struct.pack(order + "36f", *values))
        put("image_pfm", f"rgb{scale}.pfm", f"PF\n4 3\n{scale}\n".encode() + struct.pack(order + "36f", *values))
    put("image_pfm", "special.pfm", b"Pf 2 2 -3e5 " + struct.pack("<4I", 0x7f800000, 0xff800000, 0x7fc00001, 0x7f800001))
    put("image_pfm", "one_pixel.pfm", b"Pf\r\n1\t1\r\n-1\n" + struct.pack("<f", 1))

    header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n"
    flat = bytes((5 * i) % 256 for i in range(4 * 3 * 4))
    put("image_hdr", "flat.hdr", header + b"\n-Y 3 +X 4\n" + flat)
    put("image_hdr", "flipped.hdr", header + b"EXPOSURE=2\n\n+Y 3 -X 4\n" + flat)
    put("image_hdr", "turned.hdr", header + b"\n+X 4 -Y 3\n" + flat)
    put("image_hdr", "old_runs.hdr", b"#?RGBE\n\n-Y 1 +X 6\n" + bytes([9, 8, 7, 128, 1, 1, 1, 5]))
    row = b"\x02\x02\x00\x10" + b"".join(bytes([128 + 8, 10 + c, 8]) + bytes(range(8)) for c in range(4))
    put("image_hdr", "new_runs.hdr", header + b"GAMMA=1\n\n-Y 2 +X 16\n" + row * 2)


# --- Meshes: a cube each


CORNERS = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
QUADS = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
TRIANGLES = [t for q in QUADS for t in ((q[0], q[1], q[2]), (q[0], q[2], q[3]))]



def everything():
    """A document and its buffer: a skin, weights, instances, a sparse accessor, a strip of shorts, a cut-out."""
    chunks, views = [], []

    def view(data):
        offset = sum(len(chunk) for chunk in chunks)
        views.append({"buffer": 0, "byteOffset": offset, "byteLength": len(data)})
        chunks.append(data + b"\0" * (-len(data) % 4))
        return len(views) - 1

    def floats(*numbers):
        return struct.pack("<%df" % len(numbers), *numbers)

    accessors = []

    def accessor(data, component, count, kind, **more):
        accessors.append({"bufferView": view(data), "componentType": component, "count": count, "type": kind, **more})
        return len(accessors) - 1

    square = accessor(struct.pack("<12h", 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0), 5122, 4, "VEC3")
    accessors[square]["sparse"] = {"count": 1, "indices": {"bufferView": view(b"\1"), "componentType": 5121}, "values": {"bufferView": view(struct.pack("<3h", 2, 0, 0))}}
    texture = accessor(bytes([0, 0, 255, 0, 0, 255, 255, 255]), 5121, 4, "VEC2", normalized=True)
    moves = accessor(floats(*[0, 0, 1] * 4), 5126, 4, "VEC3")
    joints = accessor(bytes([0, 1, 0, 0] * 4), 5121, 4, "VEC4")
    weights = accessor(bytes([128, 127, 0, 0] * 4), 5121, 4, "VEC4", normalized=True)
    identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
    bind = accessor(floats(*identity * 2), 5126, 2, "MAT4")
    places = accessor(floats(0, 0, 0, 2, 0, 0), 5126, 2, "VEC3")
    picture = view(png(4, 4, 8, 6, False))
    attributes = {"POSITION": square, "TEXCOORD_0": texture}
    document = {
        "asset": {"version": "2.0"}, "extensionsRequired": ["KHR_mesh_quantization"], "scene": 0, "scenes": [{"nodes": [0, 1, 2]}],
        "nodes": [{"mesh": 0, "weights": [0.5], "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}}},
                  {"mesh": 1, "skin": 0}, {"children": [3], "scale": [-1, 1, 1]}, {"rotation": [0, 0, 1, 0]}],
        "meshes": [{"primitives": [{"attributes": attributes, "mode": 5, "material": 0, "targets": [{"POSITION": moves}]}]},
                   {"primitives": [{"attributes": {**attributes, "JOINTS_0": joints, "WEIGHTS_0": weights}, "mode": 6}]}],
        "skins": [{"joints": [2, 3], "inverseBindMatrices": bind}],
        "materials": [{"alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}}}}],
        "textures": [{"source": 0, "sampler": 0}], "samplers": [{"wrapS": 33648, "wrapT": 33071}],
        "images": [{"bufferView": picture, "mimeType": "image/png"}], "accessors": accessors, "bufferViews": views}
    binary = b"".join(chunks)
    document["buffers"] = [{"byteLength": len(binary)}]
    return document, binary


def meshes():
    head = "ply\nformat {}\ncomment a cube\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n{}element face 6\nproperty list uchar int vertex_indices\nend_header\n"
    put("mesh_ply", "ascii.ply", head.format("ascii 1.0", "property uchar red\n") + "".join(f"{x} {y} {z} 7\n" for x, y, z in CORNERS) +
        "".join("4 %d %d %d %d\n" % q for q in QUADS))
    for order, name in [("<", "binary_little_endian"), (">", "binary_big_endian")]:
        put("mesh_ply", name + ".ply", head.format(name + " 1.0", "").encode() + b"".join(struct.pack(order + "3f", *c) for c in CORNERS) +
            b"".join(struct.pack(order + "B4i", 4, *q) for q in QUADS))
    put("mesh_ply", "doubles.ply", "ply\nformat ascii 1.0\nelement extra 2\nproperty list uint16 float64 things\nelement vertex 3\nproperty double z\nproperty double y\nproperty int8 x\n"
        "element face 1\nproperty list int32 uint8 vertex_index\nproperty short flags\nend_header\n2 1 2\n0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2 9\n")
    polygon = "".join(f"{math.cos(i)} {math.sin(i) * (1 + i % 2)} 0\n" for i in range(40))
    put("mesh_ply", "polygon.ply", "ply\nformat ascii 1.0\nelement vertex 40\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
        "property list uint uint vertex_indices\nend_header\n" + polygon + "40 " + " ".join(map(str, range(40))) + "\n")

    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS)
    put("mesh_obj", "cube.obj", "# a cube\nmtllib none.mtl\no cube\n" + vertices + "usemtl grey\ns off\n" + "".join("f %d %d %d %d\n" % tuple(i + 1 for i in q) for q in QUADS))
    put("mesh_obj", "slashes.obj", vertices + "vt 0 0\nvn 0 0 1\ng a b\n" + "".join("f %d/1/1 %d//1 %d/1\n" % tuple(i + 1 for i in t) for t in TRIANGLES))
    put("mesh_obj", "relative.obj", "v 0 0 0 1 0.5 0.5\nv 1e0 0 0\nv 0 \\\n1 0\nf -3 -2 -1\nl 1 2\np 1\n")

    facet = "facet normal 0 0 0\n outer loop\n" + "  vertex %g %g %g\n" * 3 + " endloop\nendfacet\n"
    put("mesh_stl", "ascii.stl", "solid cube\n" + "".join(facet % tuple(v for i in t for v in CORNERS[i]) for t in TRIANGLES) + "endsolid cube\n")
    put("mesh_stl", "two.stl", ("solid\n" + facet % (0, 0, 0, 1, 0, 0, 0, 1, 0) + "endsolid\n") * 2)
    put("mesh_stl", "binary.stl", b"binary".ljust(80) + struct.pack("<I", 12) + b"".join(struct.pack("<12fH", 0, 0, 0, *(v for i in t for v in CORNERS[i]), 0x8000) for t in TRIANGLES))

    def chunk(kind, data):
        return struct.pack("<HI", kind, 6 + len(data)) + data
    faces = struct.pack("<H", 12) + b"".join(struct.pack("<4H", *t, 7) for t in TRIANGLES)
    mesh = chunk(0x4100, chunk(0x4110, struct.pack("<H", 8) + b"".join(struct.pack("<3f", *c) for c in CORNERS)) +
                 chunk(0x4120, faces + chunk(0x4130, b"grey\0" + struct.pack("<H", 1) + b"\0\0") + chunk(0x4150, struct.pack("<12I", *[1] * 12))) +
                 chunk(0x4160, struct.pack("<12f", 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0)))
    material = chunk(0xAFFF, chunk(0xA000, b"grey\0") + chunk(0xA020, chunk(0x0011, b"\x80\x80\x80")))
    keys = chunk(0xB000, chunk(0xB002, chunk(0xB030, b"\0\0") + chunk(0xB010, b"cube\0" + struct.pack("<HHH", 0, 0, 0xffff)) +
                                chunk(0xB020, bytes(10) + struct.pack("<I", 1) + bytes(6) + struct.pack("<3f", 0, 0, 0))))
    put("mesh_3ds", "cube.3ds", chunk(0x4D4D, chunk(0x0002, struct.pack("<I", 3)) + chunk(0x3D3D, material + chunk(0x4000, b"cube\0" + mesh)) + keys))
    put("mesh_3ds", "bare.3ds", chunk(0x4D4D, chunk(0x3D3D, chunk(0x4000, b"cube\0" + mesh))))

    positions = b"".join(struct.pack("<3f", *c) for c in CORNERS)
    indices = b"".join(struct.pack("<3H", *t) for t in TRIANGLES)

    def gltf(buffer):
        return {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
                "nodes": [{"mesh": 0, "children": [1], "translation": [1, 2, 3]}, {"mesh": 0, "scale": [-1, 1, 1], "rotation": [0, 0, 0, 1]}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": 4}]}],
                "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
                              {"bufferView": 1, "byteOffset": 0, "componentType": 5123, "count": 36, "type": "SCALAR"}],
                "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": len(positions), "target": 34962},
                                {"buffer": 0, "byteOffset": len(positions), "byteLength": len(indices)}],
                "buffers": [buffer]}
    binary = positions + indices
    uri = "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
    put("mesh_gltf", "cube.gltf", json.dumps(gltf({"byteLength": len(binary), "uri": uri}), indent=1))
    strip = gltf({"byteLength": len(binary), "uri": uri})
    strip["meshes"][0]["primitives"] = [{"attributes": {"POSITION": 0}, "mode": mode} for mode in (0, 1, 4, 5, 6)]
    strip["accessors"][0]["sparse"] = {"count": 1, "indices": {"bufferView": 1, "componentType": 5123}, "values": {"bufferView": 0}}
    put("mesh_gltf", "modes.gltf", json.dumps(strip))

    def glb(document, data):
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        return struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data)) + struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    put("mesh_glb", "cube.glb", glb(gltf({"byteLength": len(binary)}), binary))
    put("mesh_glb", "everything.glb", glb(*everything()))


# --- Forms, scenes, patches


def forms():
    def form(boundary, *parts, kind="multipart/form-data; boundary={}"):
        return (kind.format(boundary) + "\n").encode() + b"".join(
            f"--{boundary}\r\n{headers}\r\n\r\n".encode() + data + b"\r\n" for headers, data in parts) + f"--{boundary}--\r\n".encode()
    name = 'Content-Disposition: form-data; name="{}"'
    put("multipart", "two", form("b", (name.format("scene"), b"{}"), (name.format("front.exr") + '; filename="a \\"b\\".exr"\r\nContent-Type: image/x-exr', b"\x76\x2f\x31\x01\r\n--a\r\n")))
    put("multipart", "quoted_boundary", form("b'()+_,-./:=?0", (name.format("a"), b""), kind='Multipart/Form-Data ;charset=utf-8; Boundary="{}"'))
    put("multipart", "headers", form("b", ("content-disposition : x\r\n" + name.format("a") + "\r\nContent-Transfer-Encoding: 8bit", b"x"), ("CONTENT-DISPOSITION:form-data;NAME=b-c_d.e", b"\r\n")))
    put("multipart", "eight", form("----WebKitFormBoundary7MA4YWxkTrZu0gW", *((name.format(c), c.encode() * 9) for c in "abcdefgh")))
    put("multipart", "no_parts", b"multipart/form-data; boundary=b\n--b--")
    put("multipart", "padded", b"multipart/form-data; boundary=b\n--b \t\r\nContent-Disposition: form-data; name=a\r\n\r\n--b\r\n--b--trailer")
    put("multipart", "json", b"application/merge-patch+json; charset=utf-8\n{}")


def scenes():
    rectangle = {"kind": "rectangle", "center": [0, 6, 0], "half_u": [0.5, 0, 0], "half_v": [0, 0, -0.5]}
    view = {"kind": "pinhole", "eye": [0, 1, 5], "target": [0, 0, 0], "up": [0, 1, 0], "vertical_fov_deg": 60}
    placed = {"kind": "pinhole", "world_from_camera": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], "tan_half_fov": [1, 1]}
    own = {"kind": "light", "tan_half_fov": [0.5, 0.5]}
    quad = {"quad": {"center": [0, 0, 0], "half_u": [4, 0, 0], "half_v": [0, 0, -4]}, "scale": 1.5, "rotate_deg": [0, 30, 0], "translate": [0, 1, 0], "casts": False}
    techniques = {"soft_shadow_map": {"sides": "both"}, "shadow_map": {}, "ray_traced": {}, "smoothie": {}, "occlusion_texture": {}, "soft_shadow_volume": {}}
    put("scene", "maps.json", json.dumps({
        "penumbra": 1, "light": {**rectangle, "emission": "light.exr"},
        "occluders": {"camera": own, "resolution": [4, 3], "depth": {"front": "depth.exr", "back": "depth.exr", "layers": ["depth.exr"]}, "encoding": {"kind": "radial", "scale": 2}},
        "receivers": {"camera": placed, "depth": "depth.exr", "encoding": {"kind": "disparity", "empty": 0, "channel": "Y"}},
        "technique": {"kind": "soft_shadow_map", **techniques["soft_shadow_map"]}, "output": {"format": "exr", "bits": 32}}, indent=1))
    put("scene", "integers.json", json.dumps({
        "penumbra": 1, "light": {"kind": "point", "center": [0, 6, 0], "direction": [0, -1, 0.1], "up": [0, 0, 1]},
        "occluders": {"camera": own, "depth": {"front": "short.png"}, "encoding": {"kind": "window", "near": 0.1, "far": 9}},
        "receivers": {"camera": view, "depth": "byte.png", "encoding": {"kind": "normalized", "near": 1, "far": 9, "empty": 1}},
        "technique": {"kind": "shadow_map"}, "output": {"format": "png", "bits": 16}}))
    put("scene", "sun.json", json.dumps({
        "penumbra": 1, "light": {"kind": "directional", "angular_diameter_deg": 0.53, "direction": [1, -1, 0]},
        "occluders": {"camera": {"kind": "light", "half_extent": [2, 2], "center": [0, 3, 0]}, "depth": {"front": "depth.exr"}},
        "receivers": {"camera": {"kind": "light", "half_extent": 2}, "depth": "depth.exr"}, "output": {"format": "tif"}}))
    put("scene", "objects.json", json.dumps({
        "penumbra": 1, "light": {"kind": "sphere", "center": [0, 6, 0], "radius": 0.5},
        "objects": [quad, {"depth": "depth.exr", "camera": view, "encoding": {"kind": "planar"}, "receives": True}, {"depth": "short.png", "camera": own}],
        "receivers": {"camera": view, "resolution": [8, 8]}, "technique": {"kind": "ray_traced"}}))
    lights = [{**rectangle, "name": "fire", "emission": ["light.exr", "light.exr"], "occluders": {"camera": own, "depth": {"front": "depth.exr", "layers": ["depth.exr"]}}},
              {"kind": "point", "center": [1, 6, 0], "weight": 0.5}]
    put("scene", "lights.json", json.dumps({
        "penumbra": 1, "lights": lights, "occluders": {"camera": own, "depth": {"front": "depth.exr"}},
        "receivers": {"camera": placed, "depth": "depth.exr"}, "technique": {"kind": "ray_traced"}}))
    put("scene", "frames.json", json.dumps({
        "penumbra": 1, "light": {**rectangle, "emission": ["light.exr", "light.exr", "light.exr"]},
        "occluders": {"camera": own, "depth": {"front": "depth.exr"}}, "receivers": {"camera": own, "depth": "depth.exr"}}))
    put("scene", "channels.json", json.dumps({
        "penumbra": 1, "light": {"kind": "point", "center": [0, 6, 0]},
        "occluders": {"camera": own, "depth": {"front": "channels.exr"}, "encoding": {"kind": "planar", "channel": "near.Z", "part": 0, "precision": 0.01}},
        "receivers": {"camera": own, "depth": "channels.exr", "encoding": {"kind": "radial", "channel": "far.Z", "scale": 3}},
        "technique": {"kind": "shadow_map"}}))
    lens = {**view, "intrinsics": {"fx": 4, "fy": 4.5, "cx": 2, "cy": 1.5}, "shift": [0.25, -0.125]}
    del lens["vertical_fov_deg"]
    anchored = {"kind": "disparity", "channel": "near.Z", "anchors": [{"pixel": [0, 0], "depth": 4}, {"pixel": [3, 2], "depth": 1}]}
    put("scene", "intrinsics.json", json.dumps({
        "penumbra": 1, "light": rectangle,
        "objects": [{"depth": "channels.exr", "camera": lens, "encoding": anchored, "thickness": "auto"},
                    {"depth": "byte.png", "camera": {**view, "shift": [1, 0]}, "encoding": {"kind": "disparity", "scale": 0.5, "shift": 0.125, "precision": 1}, "thickness": 0.5}],
        "receivers": {"camera": lens, "depth": "byte.png", "encoding": {"kind": "disparity", "scale": 0.25, "shift": 0.5}},
        "technique": {"kind": "depth_trace"}}))
    put("scene", "positions.json", json.dumps({
        "penumbra": 1, "light": rectangle, "objects": [{"position": "light.exr", "camera": view, "encoding": {"scale": 2, "empty": 1}}],
        "receivers": {"camera": placed, "position": "light.exr", "encoding": {"empty": 0, "scale": -1}}, "technique": {"kind": "ray_traced"}}))
    put("scene", "weld.json", json.dumps({
        "penumbra": 1, "light": rectangle, "objects": [quad, {"mesh": "cube.ply", "weld": 0.001, "translate": [0, 1, 0]}],
        "receivers": {"camera": view, "resolution": [8, 8]}, "technique": {"kind": "soft_shadow_volume"}}))
    put("patch", "channel.json", json.dumps({"receivers": {"camera": view, "depth": "channels.exr", "encoding": {"kind": "planar", "channel": "far.Z", "part": 0, "precision": 0.5}}}))
    put("patch", "intrinsics.json", json.dumps({"receivers": {"camera": lens, "depth": "channels.exr", "encoding": anchored}}))
    put("patch", "position.json", json.dumps({"receivers": {"camera": placed, "depth": None, "position": "light.exr", "encoding": None}}))
    put("patch", "lights.json", json.dumps({"lights": lights, "light": None, "receivers": {"camera": view}}))
    for technique, keys in techniques.items():
        put("patch", technique + ".json", json.dumps({"technique": {"kind": technique, **keys}}))
    put("patch", "light.json", json.dumps({"light": {"center": [1, 6, 0]}}))
    put("patch", "other_light.json", json.dumps({"light": {"kind": "directional", "angular_diameter_deg": 1, "direction": [0, -1, 0]}, "receivers": {"camera": {"half_extent": [2, 2], "tan_half_fov": None}}}))
    put("patch", "emission.json", json.dumps({"light": {**rectangle, "emission": "light.exr"}, "output": {"format": "pfm", "bits": None}}))
    put("patch", "receivers.json", json.dumps({"receivers": {"camera": view, "depth": "depth.exr", "resolution": None, "encoding": {"kind": "radial"}}}))
    put("patch", "nulls.json", json.dumps({"light": {"up": None}, "receivers": None, "technique": None, "output": None}))
    put("patch", "empty.json", "")
    put("patch", "no_object.json", "[1]")


def main():
    with tempfile.TemporaryDirectory() as folder:
        exr(pathlib.Path(folder))
        tiff(pathlib.Path(folder))
    pngs()
    maps()
    meshes()
    forms()
    scenes()
    size = sum(file.stat().st_size for file in CORPUS.rglob("*") if file.is_file())
    print(f"{sum(1 for f in CORPUS.rglob('*') if f.is_file())} files, {size} bytes")


main()
