"""What the tests share: a service that answers by script, the real service, and numpy hidden on request.

Environment, set by ctest: PENUMBRA_SERVER and PENUMBRA_CLI, the programs; PENUMBRA_HIDE_NUMPY=1: as on a machine without numpy.
"""

import importlib.abc
import os
import re
import socket
import subprocess
import sys
import tempfile
import threading
import unittest

HIDE_NUMPY = os.environ.get("PENUMBRA_HIDE_NUMPY") == "1"


class _Hidden(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name.split(".")[0] == "numpy":
            raise ModuleNotFoundError("numpy is hidden by the test", name=name)
        return None


if HIDE_NUMPY:
    assert "numpy" not in sys.modules
    sys.meta_path.insert(0, _Hidden())

# Where the service is asked through a proxy of the environment, the tests would ask that.
for _name in ("http_proxy", "https_proxy", "HTTP_PROXY", "HTTPS_PROXY"):
    os.environ.pop(_name, None)

TOKEN = "0123456789abcdef"


class Request:
    def __init__(self, head, body):
        lines = head.decode("latin-1").split("\r\n")
        self.method, self.path, _ = lines[0].split(" ")
        self.headers = {name.lower(): value for name, value in (line.split(": ", 1) for line in lines[1:])}
        self.body = body

    def parts(self):
        boundary = re.search("boundary=(.*)", self.headers["content-type"])[1].encode()
        found = {}
        for piece in self.body.split(b"--" + boundary)[1:-1]:
            head, data = piece.split(b"\r\n\r\n", 1)
            found[re.search(rb'name="([^"]*)"', head)[1].decode()] = data[:-2]
        return found


def answer(status, body=b"", headers=()):
    text = f"HTTP/1.1 {status} x\r\nContent-Length: {len(body)}\r\nConnection: close\r\n"
    return (text + "".join(f"{name}: {value}\r\n" for name, value in headers) + "\r\n").encode() + body


def problem(status, reason, detail="detail", headers=()):
    body = f'{{"type": "about:blank", "status": {status}, "detail": "{detail}", "reason": "{reason}", "request_id": "r-1"}}'.encode()
    return answer(status, body, [("Content-Type", "application/problem+json"), *headers])


def pfm(width=2, height=1, samples=None):
    import struct

    samples = samples or [0.25 * i for i in range(width * height)]
    return f"Pf\n{width} {height}\n-1.0\n".encode() + struct.pack(f"<{len(samples)}f", *samples)


def mask_answer(body=None, headers=(), media_type="image/x-portable-floatmap"):
    return answer(200, pfm() if body is None else body, [("Content-Type", media_type), ("X-Request-Id", "r-1"), *headers])


class FakeService:
    """Gives its answers in order, one a connection, and keeps the requests. An answer is bytes, or a function that gets the connection."""

    def __init__(self, *answers, read_body=True):
        self.requests = []
        self._answers = list(answers)
        self._read_body = read_body
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self._listener.getsockname()[1]}"
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, kind, *_):
        self._listener.close()
        self._thread.join(30)
        if kind is None and self._answers:
            raise AssertionError(f"{len(self._answers)} answers were not asked for")

    def _serve(self):
        while self._answers:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return
            with connection:
                connection.settimeout(30)
                self.requests.append(self._receive(connection))
                reply = self._answers.pop(0)
                try:
                    reply(connection) if callable(reply) else connection.sendall(reply)
                except OSError:
                    pass  # the client has had enough
        self._listener.close()  # further connections are refused

    def _receive(self, connection):
        data = b""
        while b"\r\n\r\n" not in data:
            data += connection.recv(65536)
        head, body = data.split(b"\r\n\r\n", 1)
        length = re.search(rb"(?i)\r\ncontent-length: (\d+)", head)
        while self._read_body and length and len(body) < int(length[1]):
            body += connection.recv(65536)
        return Request(head, body)


class RealService:
    """penumbra-server on a free port of 127.0.0.1, ready."""

    def __init__(self, *arguments, token=TOKEN):
        environment = dict(os.environ, PENUMBRA_SERVER_TOKEN=token)
        self._process = subprocess.Popen([os.environ["PENUMBRA_SERVER"], "--port", "0", *arguments], stderr=subprocess.PIPE, text=True,
                                         env=environment)
        said = ""
        for line in self._process.stderr:
            said += line
            if line == "ready\n":
                break
        port = re.search(r"listening on 127\.0\.0\.1 port (\d+)", said)
        if not port or not said.endswith("ready\n"):
            self.stop()
            raise AssertionError(f"the service did not become ready:\n{said}")
        self.url = f"http://127.0.0.1:{port[1]}"
        self._reader = threading.Thread(target=self._process.stderr.read, daemon=True)  # so that its log never fills the pipe
        self._reader.start()

    def stop(self):
        self._process.terminate()
        self._process.wait(60)
        if hasattr(self, "_reader"):
            self._reader.join(60)
        self._process.stderr.close()


def run_penumbra(*arguments):
    return subprocess.run([os.environ["PENUMBRA_CLI"], *arguments], capture_output=True, text=True, timeout=120)


class FolderTest(unittest.TestCase):
    """With a folder that is gone afterwards."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, data):
        os.makedirs(os.path.dirname(self.path(name)), exist_ok=True)
        with open(self.path(name), "wb") as file:
            file.write(data if isinstance(data, bytes) else data.encode())
        return self.path(name)

    def read(self, name):
        with open(self.path(name), "rb") as file:
            return file.read()
