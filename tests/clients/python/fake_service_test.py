"""Retries, errors and broken answers, against a service that answers by script."""

import json
import socket
import time
import unittest
from email.utils import formatdate
from unittest import mock

import support
from support import FakeService, answer, mask_answer, problem
from penumbra_client import (BadRequest, Client, ConnectionFailed, DeadlineExceeded, NotFound, Overloaded, PenumbraError, ServerError, TooLarge,
                             Unauthorized, Unprocessable)
from penumbra_client import transport

SCENE = {"penumbra": 1}


def kept(scene_id="ab12", status=201):
    return answer(status, json.dumps({"id": scene_id, "expires_s": 600, "bytes": 7, "warnings": ["w"]}).encode(),
                  [("Content-Type", "application/json")])


class Requests(unittest.TestCase):
    def test_what_is_sent(self):
        with FakeService(mask_answer()) as service:
            client = Client(service.url + "/below/", "secret", traceparent="00-" + "1" * 32 + "-" + "2" * 16 + "-01")
            client.mask({"penumbra": 1, "light": {"center": (0, 1, 2)}}, {"front.exr": [[1.0]], "floor.png": b"\r\n--\x89PNG"})
        request, = service.requests
        self.assertEqual((request.method, request.path), ("POST", "/below/v1/masks"))
        self.assertEqual(request.headers["authorization"], "Bearer secret")
        self.assertEqual(request.headers["accept"], "image/x-portable-floatmap")
        self.assertEqual(request.headers["traceparent"], "00-" + "1" * 32 + "-" + "2" * 16 + "-01")
        self.assertNotIn("if-none-match", request.headers)
        parts = request.parts()
        self.assertEqual(json.loads(parts["scene"]), {"penumbra": 1, "light": {"center": [0, 1, 2]}})
        self.assertEqual(parts["front.exr"], b"Pf\n1 1\n-1.0\n\0\0\x80?")
        self.assertEqual(parts["floor.png"], b"\r\n--\x89PNG")

    def test_a_light_and_a_frame(self):
        with FakeService(mask_answer(), mask_answer(), kept(), mask_answer()) as service:
            client = Client(service.url)
            client.mask(SCENE, light_name="lamp-1", frame=12)
            client.mask(SCENE, frame=1)
            client.keep(SCENE).mask(lights=[{"name": "a"}], light_name="a")
            for wrong in (0, -1, True, 1.5, "1"):
                with self.assertRaises(ValueError):
                    client.mask(SCENE, frame=wrong)
        self.assertEqual([request.path for request in service.requests],
                         ["/v1/masks?light=lamp-1&frame=12", "/v1/masks?frame=1", "/v1/scenes", "/v1/scenes/ab12/masks?light=a"])
        self.assertEqual(json.loads(service.requests[3].body), {"lights": [{"name": "a"}]})

    def test_the_bound_of_a_mask(self):
        exr = mask_answer(b"an EXR", media_type="image/x-exr")
        with FakeService(exr, kept(), exr) as service:
            client = Client(service.url)
            self.assertEqual(client.mask(SCENE, format="exr", image="bound").data, b"an EXR")
            client.keep(SCENE).mask(format="exr", image="bound", light_name="a")
            for wrong in ({"image": "bound"}, {"image": "bound", "format": "png"}, {"image": "low", "format": "exr"}):
                with self.assertRaises(ValueError):
                    client.mask(SCENE, **wrong)
        self.assertEqual([request.path for request in service.requests],
                         ["/v1/masks?image=bound", "/v1/scenes", "/v1/scenes/ab12/masks?light=a&image=bound"])

    def test_what_comes_back(self):
        headers = [("Server-Timing", 'queue;dur=0.5, decode;desc="x";dur=2, cdn-cache'), ("Penumbra-Warnings", '["a, b", "\\u00e4"]'),
                   ("ETag", '"sha256-1"')]
        with FakeService(mask_answer(support.pfm(3, 2), headers)) as service:
            mask = Client(service.url).mask(SCENE)
        self.assertEqual(mask.shape, (2, 3))
        self.assertEqual(list(mask.pixels if support.HIDE_NUMPY else mask.pixels.ravel()), [0.75, 1.0, 1.25, 0.0, 0.25, 0.5])
        self.assertEqual(mask.warnings, ["a, b", "ä"])
        self.assertEqual(mask.timings, {"queue": 0.5, "decode": 2.0})
        self.assertEqual((mask.request_id, mask.etag, mask.format), ("r-1", '"sha256-1"', "array"))

    def test_file_formats(self):
        for name, media_type in (("png", "image/png"), ("exr", "image/x-exr"), ("tiff", "image/tiff"), ("pfm", "image/x-portable-floatmap")):
            with FakeService(mask_answer(b"bytes", media_type=media_type)) as service:
                mask = Client(service.url).mask(SCENE, format=name)
            self.assertEqual((mask.data, mask.pixels, mask.shape), (b"bytes", None, ()))
            self.assertEqual(service.requests[0].headers["accept"], media_type)

    def test_the_previous_mask_stands_when_nothing_changed(self):
        with FakeService(mask_answer(headers=[("ETag", '"e"')]), answer(304), mask_answer(headers=[("ETag", '"f"')])) as service:
            client = Client(service.url)
            first = client.mask(SCENE)
            self.assertIs(client.mask(SCENE, previous=first), first)
            self.assertEqual(client.mask(SCENE, previous=first).etag, '"f"')
        self.assertEqual(service.requests[1].headers["if-none-match"], '"e"')

    def test_a_304_that_nobody_asked_for(self):
        with FakeService(answer(304)) as service, self.assertRaises(ServerError):
            Client(service.url).mask(SCENE)

    def test_wrong_arguments_are_found_before_anything_is_sent(self):
        for url in ("127.0.0.1:8080", "ftp://x", "http://", "http://x?a", "http://user@x", "http://x:99999"):
            with self.subTest(url=url), self.assertRaises(ValueError):
                Client(url)
        for named in ({"timeout": 0}, {"timeout": float("nan")}, {"retries": -1}):
            with self.subTest(named), self.assertRaises(ValueError):
                Client("http://127.0.0.1:1", **named)
        client = Client("http://127.0.0.1:1")
        for scene, images, error in (([], {}, TypeError), ({"a": float("nan")}, {}, ValueError), ({"a": object()}, {}, TypeError),
                                     (SCENE, {"scene": b"x"}, ValueError), (SCENE, {"x": "/nonexistent"}, OSError)):
            with self.subTest(scene=scene), self.assertRaises(error):
                client.mask(scene, images)
        with self.assertRaisesRegex(ValueError, "format"):
            client.mask(SCENE, format="jpeg")


class Errors(unittest.TestCase):
    def test_each_status_has_its_class(self):
        for status, kind in ((400, BadRequest), (401, Unauthorized), (404, NotFound), (405, BadRequest), (408, DeadlineExceeded),
                             (413, TooLarge), (422, Unprocessable), (431, BadRequest), (500, ServerError), (503, Overloaded),
                             (504, DeadlineExceeded), (302, ServerError)):
            with self.subTest(status), FakeService(problem(status, "why", "light: is missing")) as service:
                with self.assertRaises(PenumbraError) as caught:
                    Client(service.url, retries=0).mask(SCENE)
            error = caught.exception
            self.assertIs(type(error), kind)
            self.assertEqual((error.status, error.detail, error.reason, error.request_id), (status, "light: is missing", "why", "r-1"))
            self.assertEqual(str(error), f"{status}: light: is missing")

    def test_errors_without_a_problem(self):
        for body in (b"<html>\n502</html>", b"", b"[]", b'"text"', b"\xff\xfe", b"[" * 100000):
            with self.subTest(body=body[:9]), FakeService(answer(502, body)) as service:
                with self.assertRaisesRegex(ServerError, "502: an answer without a problem description"):
                    Client(service.url).mask(SCENE)

    def test_broken_answers(self):
        cases = [b"", b"garbage\r\n\r\n", b"HTTP/1.1 200 OK\r\n", b"HTTP/1.1 2x0 OK\r\n\r\n", b"\0" * 70000,
                 b"HTTP/1.1 200 OK\r\n" + b"A: b\r\n" * 200 + b"\r\n",
                 b"HTTP/1.1 200 OK\r\nContent-Type: image/x-portable-floatmap\r\nContent-Length: 99\r\n\r\nPf",
                 mask_answer(b"Pf\n"), mask_answer(b""), mask_answer(media_type="text/html"),
                 mask_answer(headers=[("Penumbra-Warnings", "{")]), mask_answer(headers=[("Penumbra-Warnings", "3")])]
        for case in cases:
            with self.subTest(case=case[:80]), FakeService(case) as service:
                with self.assertRaises((ServerError, ConnectionFailed)):
                    Client(service.url).mask(SCENE)
        for case in (answer(200, b"{"), answer(200, b"[]"), answer(200, b'{"techniques": 3}')):
            with self.subTest(case=case), FakeService(case) as service, self.assertRaises(ServerError):
                Client(service.url).techniques()
        for case in (kept(scene_id="../masks"), kept(scene_id=""), answer(200, b'{"id": 3}')):
            with self.subTest(case=case), FakeService(case) as service, self.assertRaises(ServerError):
                Client(service.url).keep(SCENE)

    def test_slow_answers_end_at_the_timeout(self):
        def silent(connection):
            connection.recv(1)

        def trickling(connection):
            for _ in range(300):
                connection.sendall(b"H")  # a header line without end
                time.sleep(0.05)

        def trickling_body(connection):
            connection.sendall(b"HTTP/1.1 200 OK\r\nContent-Length: 999\r\n\r\n")
            trickling(connection)

        for slow in (silent, trickling, trickling_body):
            with self.subTest(slow.__name__), FakeService(slow) as service:
                begun = time.monotonic()
                with self.assertRaises(DeadlineExceeded) as caught:
                    Client(service.url, timeout=0.5).mask(SCENE)
                self.assertLess(time.monotonic() - begun, 10)
            self.assertEqual((caught.exception.status, caught.exception.reason), (None, "timeout"))

    def test_an_upload_that_is_refused_early_says_why(self):
        def refuse(connection):
            connection.sendall(problem(413, "body_bytes"))
            connection.shutdown(socket.SHUT_WR)
            while connection.recv(1 << 16):
                pass

        with FakeService(refuse, read_body=False) as service, self.assertRaises(TooLarge):
            Client(service.url).mask(SCENE, {"x": bytes(1 << 24)})


class Retries(unittest.TestCase):
    def setUp(self):
        self.pauses = []
        patch = mock.patch.object(transport, "sleep", self.pauses.append)
        patch.start()
        self.addCleanup(patch.stop)

    def test_again_after_503(self):
        with FakeService(problem(503, "queue_full"), problem(503, "queue_full"), problem(503, "queue_full"), mask_answer()) as service:
            Client(service.url).mask(SCENE)
        self.assertEqual(len(service.requests), 4)
        self.assertEqual(len({request.body.split(b"\r\n")[0] for request in service.requests}), 1)  # the same bytes
        for pause, longest in zip(self.pauses, (0.25, 0.5, 1.0)):
            self.assertTrue(longest / 2 <= pause <= longest, self.pauses)

    def test_never_sooner_than_asked(self):
        in_ten_seconds = formatdate(time.time() + 10, usegmt=True)
        with FakeService(problem(503, "starting", headers=[("Retry-After", "5")]),
                         problem(503, "starting", headers=[("Retry-After", in_ten_seconds)]),
                         problem(503, "starting", headers=[("Retry-After", "soon")]), mask_answer()) as service:
            Client(service.url).mask(SCENE)
        self.assertTrue(5.125 <= self.pauses[0] <= 5.25, self.pauses)
        self.assertTrue(8 <= self.pauses[1] <= 10.5, self.pauses)
        self.assertTrue(0.5 <= self.pauses[2] <= 1, self.pauses)

    def test_gives_up(self):
        with FakeService(*[problem(503, "queue_full", headers=[("Retry-After", "1")])] * 3) as service:
            with self.assertRaises(Overloaded) as caught:
                Client(service.url, retries=2).mask(SCENE)
        self.assertEqual(caught.exception.retry_after, 1)
        self.assertEqual(len(self.pauses), 2)
        with FakeService(problem(503, "queue_full", headers=[("Retry-After", "3600")])) as service, self.assertRaises(Overloaded):
            Client(service.url).mask(SCENE)
        self.assertEqual(len(self.pauses), 2)

    def test_nothing_else_is_tried_again(self):
        for reply in (problem(400, "x"), problem(408, "x"), problem(500, "x"), problem(504, "x"), b"", b"garbage\r\n\r\n"):
            with self.subTest(reply=reply), FakeService(reply) as service:
                with self.assertRaises(PenumbraError):
                    Client(service.url).mask(SCENE)
                self.assertEqual(len(service.requests), 1)
        self.assertEqual(self.pauses, [])

    def test_refused_connections(self):
        with socket.create_server(("127.0.0.1", 0)) as listener:
            url = f"http://127.0.0.1:{listener.getsockname()[1]}"
        with self.assertRaises(ConnectionFailed) as caught:
            Client(url, retries=3).mask(SCENE)
        self.assertEqual((len(self.pauses), caught.exception.reason), (3, "refused"))

        with FakeService(mask_answer()) as service:
            port = int(service.url.rsplit(":", 1)[1])
            real, calls = socket.create_connection, []

            def refuse_once(address, *args, **named):
                calls.append(address)
                if len(calls) == 1:
                    raise ConnectionRefusedError("refused by the test")
                return real(address, *args, **named)

            with mock.patch("socket.create_connection", refuse_once):
                Client(f"http://127.0.0.1:{port}").mask(SCENE)
        self.assertEqual((len(calls), len(self.pauses)), (2, 4))

    def test_an_unknown_host_is_not_tried_again(self):
        with self.assertRaises(ConnectionFailed):
            Client("http://no-such-host.invalid").mask(SCENE)
        self.assertEqual(self.pauses, [])

    def test_ready_asks_once(self):
        with FakeService(answer(503), answer(200), problem(401, "token")) as service:
            client = Client(service.url)
            self.assertIs(client.ready(), False)
            self.assertIs(client.ready(), True)
            with self.assertRaises(Unauthorized):
                client.ready()
        self.assertEqual(self.pauses, [])


class Keeping(unittest.TestCase):
    def test_patches(self):
        with FakeService(kept(), mask_answer(), mask_answer(), answer(204)) as service:
            with Client(service.url, "secret").keep(SCENE, {"front.exr": b"x"}) as scene:
                self.assertEqual((scene.id, scene.expires_s, scene.size_bytes, scene.warnings), ("ab12", 600, 7, ["w"]))
                scene.mask(light={"center": [1, 2, 3], "radius": None}, technique={"kind": "shadow_map"})
                scene.mask(receivers={"depth": "other.exr"}, images={"other.exr": b"y"}, format="array")
        upload, changed, other, forget = service.requests
        self.assertEqual((upload.path, upload.parts()["front.exr"]), ("/v1/scenes", b"x"))
        self.assertEqual((changed.method, changed.path), ("POST", "/v1/scenes/ab12/masks"))
        self.assertEqual(changed.headers["content-type"], "application/merge-patch+json")
        self.assertEqual(json.loads(changed.body), {"light": {"center": [1, 2, 3], "radius": None}, "technique": {"kind": "shadow_map"}})
        self.assertEqual(other.parts(), {"scene": b'{"receivers": {"depth": "other.exr"}}', "other.exr": b"y"})
        self.assertEqual((forget.method, forget.path), ("DELETE", "/v1/scenes/ab12"))
        self.assertTrue(all(request.headers["authorization"] == "Bearer secret" for request in service.requests))

    def test_uploads_again_when_forgotten(self):
        with FakeService(kept(), problem(404, "no_scene"), kept("cd34"), mask_answer()) as service:
            scene = Client(service.url).keep(SCENE, {"front.exr": b"x"})
            scene.mask()
        self.assertEqual([request.path for request in service.requests],
                         ["/v1/scenes", "/v1/scenes/ab12/masks", "/v1/scenes", "/v1/scenes/cd34/masks"])
        self.assertEqual(service.requests[0].parts(), service.requests[2].parts())

    def test_once_only_and_for_that_reason_only(self):
        with FakeService(kept(), problem(404, "no_scene"), kept(), problem(404, "no_scene")) as service:
            scene = Client(service.url).keep(SCENE)
            with self.assertRaises(NotFound):
                scene.mask()
        with FakeService(kept(), problem(404, "no_route")) as service:
            scene = Client(service.url).keep(SCENE)
            with self.assertRaises(NotFound):
                scene.mask()

    def test_forgetting_twice(self):
        with FakeService(kept(), answer(204), problem(404, "no_scene")) as service:
            scene = Client(service.url).keep(SCENE)
            scene.forget()
            scene.forget()


if __name__ == "__main__":
    unittest.main()
