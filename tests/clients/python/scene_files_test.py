"""Scene files: names become parts."""

import json
import os

import support
from penumbra_client import load_scene_file


class SceneFiles(support.FolderTest):
    def test_every_place_that_names_a_file(self):
        names = ["e.exr", "f.exr", "b.exr", "l0.exr", "l1.exr", "r.exr", "m.obj", "d.exr"]
        for name in names:
            self.write(name, "of " + name)
        scene = {"light": {"emission": "e.exr"}, "occluders": {"depth": {"front": "f.exr", "back": "b.exr", "layers": ["l0.exr", "l1.exr"]}},
                 "receivers": {"depth": "r.exr"}, "objects": [{"mesh": "m.obj"}, {"depth": "d.exr"}, {"quad": {}}]}
        read, images = load_scene_file(self.write("scene.json", json.dumps(scene)))
        self.assertEqual(read, scene)
        self.assertEqual(images, {name: b"of " + name.encode() for name in names})

    def test_lights_and_frames_name_files_too(self):
        names = ["1.exr", "2.exr", "e.exr", "f.exr", "l.exr", "s.exr"]
        for name in names:
            self.write(name, "of " + name)
        scene = {"lights": [{"emission": ["1.exr", "2.exr", "1.exr"]},
                            {"emission": "e.exr", "occluders": {"depth": {"front": "f.exr", "layers": ["l.exr"]}}}, 3],
                 "occluders": {"depth": {"front": "s.exr"}}}
        read, images = load_scene_file(self.write("scene.json", json.dumps(scene)))
        self.assertEqual(read, scene)
        self.assertEqual(images, {name: b"of " + name.encode() for name in names})

    def test_names_that_clash_are_told_apart(self):
        self.write("scene.json", json.dumps({"light": {"emission": "a/x.exr"}, "receivers": {"depth": "b/x.exr"},
                                             "objects": [{"mesh": "./a/../a/x.exr"}, {"mesh": "scene"}, {"mesh": "c/x-2.exr"}]}))
        for name in ("a/x.exr", "b/x.exr", "scene", "c/x-2.exr"):
            self.write(name, name)
        scene, images = load_scene_file(self.path("scene.json"))
        self.assertEqual(scene["light"]["emission"], "x.exr")
        self.assertEqual(scene["objects"][0]["mesh"], "x.exr")  # the same file, sent once
        self.assertEqual(scene["objects"][1]["mesh"], "scene-2")
        self.assertEqual(scene["objects"][2]["mesh"], "x-2-2.exr" if scene["receivers"]["depth"] == "x-2.exr" else "x-2.exr")
        self.assertEqual(len(images), 4)
        self.assertEqual(images[scene["receivers"]["depth"]], b"b/x.exr")
        self.assertEqual(images[scene["objects"][2]["mesh"]], b"c/x-2.exr")

    def test_names_that_the_service_does_not_allow(self):
        long = "n" * 200 + ".exr"
        for name, expected in (("my depth (1).exr", "my_depth__1_.exr"), (".hidden.exr", "hidden.exr"), ("tiefe-ä.exr", "tiefe-_.exr"),
                               (long, long[-120:])):
            self.write(name, "x")
            scene, images = load_scene_file(self.write("scene.json", json.dumps({"receivers": {"depth": name}})))
            self.assertEqual(scene["receivers"]["depth"], expected)
            self.assertEqual(list(images), [expected])

    def test_an_absolute_name_and_another_folder(self):
        image = self.write("elsewhere/x.exr", "x")
        self.write("scenes/scene.json", json.dumps({"receivers": {"depth": image}, "light": {"emission": "../elsewhere/x.exr"}}))
        scene, images = load_scene_file(self.path("scenes/scene.json"))
        self.assertEqual((scene["receivers"]["depth"], scene["light"]["emission"]), ("x.exr", "x.exr"))
        self.assertEqual(images, {"x.exr": b"x"})

    def test_what_is_no_name_stays(self):
        scene = {"light": [], "occluders": {"depth": "front.exr"}, "receivers": {"depth": 3}, "objects": {"mesh": "m.obj"}, "unknown": None}
        self.assertEqual(load_scene_file(self.write("scene.json", json.dumps(scene))), (scene, {}))

    def test_refusals(self):
        for text, complaint in (("", "scene.json"), ("[]", "not a JSON object"), ('{"a": 1, "a": 2}', "'a' stands twice"),
                                ('{"a": NaN}', "NaN"), ("[" * 100000, "scene.json"), (b"\xff{}", "scene.json")):
            with self.subTest(text=text[:20]), self.assertRaisesRegex(ValueError, complaint):
                load_scene_file(self.write("scene.json", text))
        with self.assertRaises(FileNotFoundError):
            load_scene_file(self.write("scene.json", '{"receivers": {"depth": "none.exr"}}'))
        with self.assertRaises(FileNotFoundError):
            load_scene_file(os.path.join(self.folder, "none.json"))
