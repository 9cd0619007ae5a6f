"""The real service: the same bytes as the command line on the same device, from arrays, files, kept scenes and the module's own command."""

import copy
import json
import os
import socket
import subprocess
import sys
import threading
import unittest

import support
from support import TOKEN, RealService
from penumbra_client import Client, ConnectionFailed, NotFound, TooLarge, Unauthorized, Unprocessable, load_scene_file
from penumbra_client.images import encode_image, numpy

SIDE = 32
FRONT = [[1.0 if 8 <= x < 24 and 8 <= y < 20 else float("inf") for x in range(SIDE)] for y in range(SIDE)]
FLOOR = [[2.0] * 20 for _ in range(SIDE)]
CAMERA = {"kind": "light", "tan_half_fov": [1, 1]}
SCENE = {
    "penumbra": 1,
    "light": {"kind": "rectangle", "center": [0, 0, 0], "half_u": [0.25, 0, 0], "half_v": [0, 0, -0.25]},
    "occluders": {"camera": CAMERA, "depth": {"front": "front.pfm"}},
    "receivers": {"camera": {"kind": "light", "tan_half_fov": [0.5, 0.5]}, "depth": "floor.pfm"},
    "technique": {"kind": "soft_shadow_map", "sides": "front"},
}
IMAGES = {"front.pfm": FRONT, "floor.pfm": FLOOR}
TRIANGLE = "v -1 2 -1\nv 1 2 -1\nv 0 2 1\nf 1 2 3\n"

service = None


def closed_url():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return f"http://127.0.0.1:{listener.getsockname()[1]}"


def setUpModule():
    global service
    service = RealService("--body-bytes", "4194304")


def tearDownModule():
    service.stop()


def client(**named):
    return Client(service.url, TOKEN, **named)


class Service(support.FolderTest):
    def write_scene(self, scene=None, name="scene.json"):
        for image, rows in IMAGES.items():
            self.write(image, encode_image(rows))
        return self.write(name, json.dumps(scene or SCENE))

    def local(self, scene=None, name="local.pfm"):
        """The bytes that `penumbra mask` writes for it."""
        ran = support.run_penumbra("mask", self.write_scene(scene), "-o", self.path(name))
        self.assertEqual(ran.returncode, 0, ran.stderr)
        return self.read(name)

    def test_the_same_bytes_as_the_command_line(self):
        expected = self.local()
        mask = client().mask(SCENE, IMAGES)
        self.assertEqual(mask.data, expected)
        self.assertEqual(mask.shape, (SIDE, 20))
        pixels = list(mask.pixels) if support.HIDE_NUMPY else list(mask.pixels.ravel())
        self.assertTrue(min(pixels) < 0.5 < max(pixels) == 1.0)  # there is a shadow
        self.assertIn("decode", mask.timings)
        self.assertTrue(all(ms >= 0 for ms in mask.timings.values()))
        self.assertTrue(mask.request_id)

    def test_from_a_scene_file(self):
        expected = self.local()
        self.assertEqual(client().mask(*load_scene_file(self.path("scene.json"))).data, expected)

    def test_two_files_of_one_name(self):
        scene = copy.deepcopy(SCENE)
        scene["occluders"]["depth"]["front"] = "a/depth.pfm"
        scene["receivers"]["depth"] = "b/depth.pfm"
        self.write("a/depth.pfm", encode_image(FRONT))
        self.write("b/depth.pfm", encode_image(FLOOR))
        self.assertEqual(client().mask(*load_scene_file(self.write("scene.json", json.dumps(scene)))).data, self.local())

    def test_the_modules_command(self):
        self.local(name="mask.exr")
        for extension in (".exr", ".png", ".tif", ".pfm"):
            local = self.local(name="mask" + extension)
            ran = self.run_module(self.path("scene.json"), "-o", self.path("remote" + extension), "--server", service.url)
            self.assertEqual((ran.returncode, ran.stdout, ran.stderr), (0, "", ""))
            self.assertEqual(self.read("remote" + extension)[:4], local[:4])
            compared = support.run_penumbra("compare", self.path("remote" + extension), self.path("mask" + extension), "--json")
            self.assertEqual(json.loads(compared.stdout)["max"], 0, extension)
            if extension == ".pfm":
                self.assertEqual(self.read("remote.pfm"), local)
        self.assertFalse([name for name in os.listdir(self.folder) if name.startswith("remote") and name.count(".") > 1])  # nothing left over

    def test_the_modules_command_fails_in_one_line(self):
        scene = self.write_scene()
        for arguments, code, said in ((["none.json", "-o", "m.pfm"], 2, "none.json"), ([scene, "-o", "m.jpg"], 2, ".exr"),
                                      ([scene, "-o", "none/m.pfm"], 2, "none"),
                                      ([scene, "-o", "m.pfm", "--server", closed_url()], 1, "refused"),
                                      ([scene, "-o", "m.pfm", "--server", "ftp://x"], 2, "ftp://x"),
                                      ([self.write("bad.json", "{}"), "-o", "m.pfm", "--server", service.url], 2, "422")):
            ran = self.run_module(*arguments)
            self.assertEqual((ran.returncode, ran.stdout, ran.stderr.count("\n")), (code, "", 1), ran.stderr)
            self.assertIn(said, ran.stderr)

    def run_module(self, *arguments):
        environment = dict(os.environ, PENUMBRA_SERVER_TOKEN=TOKEN)
        return subprocess.run([sys.executable, "-m", "penumbra_client", *arguments], capture_output=True, text=True, env=environment,
                              cwd=self.folder, timeout=120)

    def test_warnings(self):
        wide = dict(SCENE, receivers={"camera": CAMERA, "depth": "floor.pfm"})
        mask = client().mask(wide, IMAGES)
        self.assertEqual(len(mask.warnings), 1)
        self.assertIn("past the occluder map's border", mask.warnings[0])
        self.assertEqual(client().mask(SCENE, IMAGES).warnings, [])

    def test_errors_name_the_key(self):
        scene = copy.deepcopy(SCENE)
        scene["light"]["half_v"] = [0.25, 0, 0.5]
        with self.assertRaisesRegex(Unprocessable, "light.half_v") as caught:
            client().mask(scene, IMAGES)
        self.assertEqual((caught.exception.status, caught.exception.reason), (422, "invalid_input"))
        self.assertTrue(caught.exception.request_id)
        with self.assertRaisesRegex(Unprocessable, "floor.pfm"):
            client().mask(SCENE, {"front.pfm": FRONT})
        with self.assertRaises(Unauthorized):
            Client(service.url).mask(SCENE, IMAGES)
        with self.assertRaisesRegex(TooLarge, "4194304"):
            client().mask(SCENE, {"x": bytes(100_000_000)})  # refused by its length, before it is read
        with self.assertRaises(NotFound):
            Client(service.url + "/nowhere", TOKEN).mask(SCENE, IMAGES)

    def test_meshes_need_a_service_that_takes_them(self):
        self.write("t.obj", TRIANGLE)
        scene = dict(SCENE, objects=[{"mesh": "t.obj"}])
        self.write_scene(scene)
        with self.assertRaisesRegex(Unprocessable, "allow-meshes"):
            client().mask(*load_scene_file(self.path("scene.json")))

    def test_what_it_says_about_itself(self):
        self.assertIs(client().ready(), True)
        kinds = [technique["kind"] for technique in client().techniques()]
        self.assertIn("soft_shadow_map", kinds)
        devices = client().devices()
        self.assertEqual(sum(device["selected"] for device in devices["devices"]), 1)
        self.assertTrue(devices["version"])

    def test_from_several_threads(self):
        expected, shared, found = client().mask(SCENE, IMAGES).data, client(), []
        threads = [threading.Thread(target=lambda: found.append(shared.mask(SCENE, IMAGES).data)) for _ in range(6)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(found, [expected] * 6)

    @unittest.skipIf(support.HIDE_NUMPY, "without numpy there are no numpy arrays")
    def test_numpy_arrays_and_numbers(self):
        images = {name: numpy.array(rows, numpy.float32) for name, rows in IMAGES.items()}
        scene = dict(SCENE, light=dict(SCENE["light"], half_u=numpy.array([0.25, 0, 0])))
        self.assertEqual(client().mask(scene, images).data, client().mask(SCENE, IMAGES).data)

    def test_a_service_that_is_gone(self):
        gone = RealService()
        gone.stop()
        with self.assertRaises(ConnectionFailed):
            Client(gone.url, TOKEN, retries=1).mask(SCENE, IMAGES)


class Kept(unittest.TestCase):
    def test_changes_are_as_in_a_whole_scene(self):
        with client().keep(SCENE, IMAGES) as kept:
            self.assertEqual(kept.mask().data, client().mask(SCENE, IMAGES).data)
            moved = copy.deepcopy(SCENE)
            moved["light"]["half_u"] = [0.5, 0, 0]
            wider = kept.mask(light={"half_u": [0.5, 0, 0]}).data
            self.assertEqual(wider, client().mask(moved, IMAGES).data)
            self.assertNotEqual(wider, client().mask(SCENE, IMAGES).data)
            self.assertEqual(kept.mask().data, client().mask(SCENE, IMAGES).data)  # for that request only

            other = dict(SCENE, technique={"kind": "shadow_map"})
            self.assertEqual(kept.mask(technique={"kind": "shadow_map"}).data, client().mask(other, IMAGES).data)

            near = [[1.5] * 7 for _ in range(9)]
            mask = kept.mask(receivers={"depth": "near.pfm"}, images={"near.pfm": near})
            self.assertEqual(mask.shape, (9, 7))
            self.assertEqual(mask.data, client().mask(SCENE, {"front.pfm": FRONT, "floor.pfm": near}).data)
            with self.assertRaisesRegex(Unprocessable, "half_v"):
                kept.mask(light={"half_v": [1, 0, 1]})

    def test_the_same_upload_has_the_same_id(self):
        self.assertEqual(client().keep(SCENE, IMAGES).id, client().keep(SCENE, IMAGES).id)

    def test_a_forgotten_scene_is_uploaded_again(self):
        kept = client().keep(SCENE, IMAGES)
        expected = kept.mask().data
        kept.forget()
        self.assertEqual(kept.mask().data, expected)
        kept.forget()
        kept.forget()

    def test_the_previous_mask_stands(self):
        first = client().mask(SCENE, IMAGES)
        self.assertTrue(first.etag)
        self.assertIs(client().mask(SCENE, IMAGES, previous=first), first)
        moved = dict(SCENE, light=dict(SCENE["light"], center=[0.5, 0, 0]))
        self.assertIsNot(client().mask(moved, IMAGES, previous=first), first)


if __name__ == "__main__":
    unittest.main()
