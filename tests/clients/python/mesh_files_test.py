"""Files that meshes name: they become parts, found by the mesh's own names for them."""

import json
import struct
import zlib

import support
from penumbra_client import Client, load_scene_file

SQUARE = "v -.5 2 .5\nv .5 2 .5\nv .5 2 -.5\nv -.5 2 -.5\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl pane\nf 1/1 2/2 3/3 4/4\n"


def png(alpha):
    """One row of white pixels."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", len(alpha), 1, 8, 4, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(b"\0" + b"".join(bytes([255, a]) for a in alpha))) + chunk(b"IEND", b""))


def gltf_square(uri, image):
    """The square and its bytes."""
    data = struct.pack("<20f", -.5, 2, .5, .5, 2, .5, .5, 2, -.5, -.5, 2, -.5, 0, 1, 1, 1, 1, 0, 0, 0) + bytes([0, 1, 2, 0, 2, 3])
    views = [{"buffer": 0, "byteOffset": at, "byteLength": size} for at, size in ((0, 48), (48, 32), (80, 6))]
    accessors = [{"bufferView": view, "componentType": kind, "count": count, "type": type}
                 for view, kind, count, type in ((0, 5126, 4, "VEC3"), (1, 5126, 4, "VEC2"), (2, 5121, 6, "SCALAR"))]
    return json.dumps({
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "buffers": [{"byteLength": len(data), "uri": uri}], "bufferViews": views, "accessors": accessors,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [{"alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}], "images": [{"uri": image}]}), data


class MeshFiles(support.FolderTest):
    def load(self, *meshes):
        return load_scene_file(self.write("scene.json", json.dumps({"objects": [{"mesh": mesh} for mesh in meshes]})))

    def parts_of(self, mesh):
        return sorted(self.load(mesh)[1])

    def test_parts_of_their_own_names_need_no_table(self):
        self.write("t/a.obj", "mtllib a.mtl\n" + SQUARE)
        self.write("t/a.mtl", "newmtl pane\nmap_d a.png\n")
        self.write("t/a.png", "a picture")
        scene, images = self.load("t/a.obj")
        self.assertEqual(scene, {"objects": [{"mesh": "a.obj"}]})
        self.assertEqual(images, {name: self.read("t/" + name) for name in ("a.obj", "a.mtl", "a.png")})

    def test_others_have_one(self):
        self.write("a.gltf", json.dumps({"buffers": [{"uri": uri} for uri in ("my%20mesh.bin", "b/x.bin", "data:,x", "%zz%4")] + [{}]}))
        for name in ("my mesh.bin", "b/x.bin", "%zz%4"):
            self.write(name, name)
        scene, images = self.load("a.gltf", "./a.gltf")
        files = {"my mesh.bin": "my_mesh.bin", "b/x.bin": "x.bin", "%zz%4": "_zz_4"}
        self.assertEqual(scene["objects"], [{"mesh": "a.gltf", "files": files}] * 2)
        self.assertEqual(len(images), 4)
        self.assertEqual(images["my_mesh.bin"], b"my mesh.bin")

    def test_files_that_the_scene_names(self):
        self.write("m.gltf", json.dumps({"buffers": [{"uri": "not looked for.bin"}]}))
        self.write("a b.bin", "x")
        objects = [{"mesh": "m.gltf", "files": {"n.bin": "a b.bin", "m.bin": "./a b.bin", "k": 3}}, {"files": []}]
        scene, images = load_scene_file(self.write("scene.json", json.dumps({"objects": objects})))
        self.assertEqual(scene["objects"], [{"mesh": "m.gltf", "files": {"n.bin": "a_b.bin", "m.bin": "a_b.bin", "k": 3}}, {"files": []}])
        self.assertEqual(images["a_b.bin"], b"x")

    def test_a_glb_too(self):
        text = json.dumps({"buffers": [{}, {"uri": "x.bin"}]}).encode()
        self.write("x.bin", "x")
        self.write("a.GLB", b"glTF" + bytes(8) + struct.pack("<I", len(text)) + b"JSON" + text + bytes(8))
        self.assertEqual(self.parts_of("a.GLB"), ["a.GLB", "x.bin"])

    def test_of_a_gltf_the_cut_outs_that_it_draws(self):
        def material(mode, index):
            return {"alphaMode": mode, "pbrMetallicRoughness": {"baseColorTexture": {"index": index}}}

        self.write("a.gltf", json.dumps({
            "images": [{"uri": "no.png"}, {"uri": "leaf.png"}, {"uri": "no.png"}], "textures": [{"source": 1}, {"source": 0}, {}],
            "materials": [material("MASK", 0), material("BLEND", 1), material("MASK", 1), material("MASK", 2), {"alphaMode": "MASK"}],
            "meshes": [{"primitives": [{"material": 0}, {"material": 1}, {"material": 3}, {"material": 4}, {"material": 9}, {}]}, 3]}))
        self.write("leaf.png", "x")
        self.assertEqual(self.parts_of("a.gltf"), ["a.gltf", "leaf.png"])

    def test_of_an_obj_the_cut_outs_that_it_uses(self):
        self.write("a.obj", b"\xef\xbb\xbfmtllib two words.mtl # mtllib c.mtl\r\nmtllib \\\na.mtl b.mtl\n# \\\nusemtl  pane \nusemtl bark\nmtllib\n")
        self.write("two words.mtl", "newmtl pane\n\tMAP_D -clamp on -o 1 +2 -mm 0 1 -s 1 tex\\a leaf.png\nmap_Kd no.png\nnewmtl other\n"
                                    "map_d no.png\n")
        self.write("b.mtl", "newmtl bark\rmap_d -imfchan l b.png")
        for name in ("a.mtl", "c.mtl", "no.png", "b.png", "tex/a leaf.png"):
            self.write(name, "x")
        self.assertEqual(self.parts_of("a.obj"), ["a.mtl", "a.obj", "a_leaf.png", "b.mtl", "b.png", "two_words.mtl"])

    def test_meshes_that_name_different_files_alike(self):
        for folder in "abc":
            self.write(folder + "/m.obj", "mtllib m.mtl\n")
        self.write("b/m.mtl", "b")
        self.write("c/m.mtl", "c")
        scene, images = self.load("a/m.obj", "b/m.obj", "c/m.obj")
        # The first has none: no part has the name.
        self.assertEqual(scene["objects"], [{"mesh": "m.obj"}, {"mesh": "m-2.obj", "files": {"m.mtl": "m-2.mtl"}},
                                            {"mesh": "m-3.obj", "files": {"m.mtl": "m-3.mtl"}}])
        self.assertEqual(images["m-2.mtl"], b"b")
        self.assertEqual(self.load("b/m.obj", "a/m.obj")[0]["objects"], [{"mesh": "m.obj"}, {"mesh": "m-2.obj", "files": {}}])

    def test_what_is_missing(self):
        for uri, name in (("gone%20too.bin", "gone too.bin"), ("%ff.bin", "\\\\udcff.bin"), (".", r"\.")):
            self.write("a.gltf", json.dumps({"buffers": [{"uri": uri}]}))
            with self.subTest(uri=uri), self.assertRaisesRegex(OSError, f'a.gltf names "{name}": '):
                self.load("a.gltf")
        self.write("a.obj", b"mtllib gone.mtl \xff.bin empty.mtl\nusemtl x\n")
        self.write("empty.mtl", "")
        self.assertEqual(self.parts_of("a.obj"), ["a.obj"])

    def test_broken_meshes_are_for_the_service_to_refuse(self):
        for text in ("{", "[]", "3", "glTF", b"glTF" + b"\xff" * 16, "[" * 100000, '{"buffers": {"uri": 3}, "meshes": "x", "images": [3]}'):
            self.write("a.gltf", text)
            self.assertEqual(self.parts_of("a.gltf"), ["a.gltf"])


class MeshFilesAndService(support.FolderTest):
    @classmethod
    def setUpClass(cls):
        cls.service = support.RealService("--allow-meshes")
        cls.addClassCleanup(cls.service.stop)

    def expect_half_a_shadow(self, mesh):
        """The same bytes as here, and half of what the square would cast: a quarter of the floor."""
        floor = {"quad": {"center": [0, 0, 0], "half_u": [2, 0, 0], "half_v": [0, 0, -2]}, "casts": False}
        scene = self.write("scene.json", json.dumps({
            "penumbra": 1, "light": {"kind": "point", "center": [0, 4, 0]}, "objects": [{"mesh": mesh, "receives": False}, floor],
            "receivers": {"camera": {"kind": "light", "tan_half_fov": 0.5}, "resolution": [64, 64]},
            "technique": {"kind": "ray_traced", "samples": 1}}))
        local = support.run_penumbra("mask", scene, "-o", self.path("local.pfm"))
        self.assertEqual((local.returncode, local.stderr), (0, ""))
        mask = Client(self.service.url, support.TOKEN).mask(*load_scene_file(scene), format="pfm")
        self.assertEqual(mask.data, self.read("local.pfm"))
        self.assertEqual(mask.warnings, [])
        dark = mask.data[-4 * 64 * 64:].count(bytes(4))
        self.assertAlmostEqual(dark, 64 * 64 / 8, delta=64)

    def test_an_obj_with_its_library_and_cut_out(self):
        self.write("a.obj", "mtllib my a.mtl\n" + SQUARE)
        self.write("my a.mtl", "newmtl pane\nmap_d half a pane.png\n")
        self.write("half a pane.png", png(b"\0\xff"))
        self.expect_half_a_shadow("a.obj")

    def test_a_gltf_with_spaces_in_its_names(self):
        text, data = gltf_square("my%20square.bin", "tex/half%20a%20pane.png")
        self.write("a.gltf", text)
        self.write("my square.bin", data)
        self.write("tex/half a pane.png", png(b"\0\xff"))
        self.expect_half_a_shadow("a.gltf")
