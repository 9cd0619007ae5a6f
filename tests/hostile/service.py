"""The real service as a child process, what its processes take, and requests to it."""

import json
import os
import re
import signal
import socket
import subprocess
import threading


class Answer:
    def __init__(self, data):
        head, _, self.body = data.partition(b"\r\n\r\n")
        found = re.match(rb"HTTP/1\.1 (\d{3}) ", head)
        self.status = int(found.group(1)) if found else 0
        self.headers = {}
        for line in head.split(b"\r\n")[1:]:
            name, _, value = line.partition(b": ")
            self.headers[name.decode("latin-1").lower()] = value.decode("latin-1")

    @property
    def problem(self):
        try:
            return json.loads(self.body) if self.status >= 400 else {}
        except ValueError:
            return {}

    @property
    def reason(self):
        return self.problem.get("reason", "")

    def __str__(self):
        return f"{self.status} {self.reason}: {self.problem.get('detail', '')}" if self.status >= 400 else str(self.status)


def form(scene, parts=None):
    """A request's body: `scene` is a dictionary or JSON text."""
    text = scene if isinstance(scene, (str, bytes)) else json.dumps(scene)
    pieces = []
    for name, data in [("scene", text.encode() if isinstance(text, str) else text), *(parts or {}).items()]:
        pieces.append(f'--B\r\nContent-Disposition: form-data; name="{name}"; filename="x"\r\n\r\n'.encode() + data + b"\r\n")
    return b"".join(pieces) + b"--B--\r\n"


def request(method, path, body=b"", headers=()):
    lines = [f"{method} {path} HTTP/1.1", "Host: 127.0.0.1"]
    if body or method == "POST":
        lines.append(f"Content-Length: {len(body)}")
    return "\r\n".join([*lines, *headers, "", ""]).encode() + body


def post(path, body, accept="image/x-portable-floatmap", content="multipart/form-data; boundary=B"):
    return request("POST", path, body, [f"Content-Type: {content}", f"Accept: {accept}"])


class Visitor:
    """Requests to a service that runs, by its port and the id of its process."""

    def __init__(self, port, pid):
        self.port, self.pid = port, pid

    def connect(self):
        return socket.create_connection(("127.0.0.1", self.port), timeout=120)

    def send(self, data):
        """One request, its answer."""
        with self.connect() as connection:
            try:
                connection.sendall(data)
            except (BrokenPipeError, ConnectionResetError):
                pass
            got = []
            try:
                while piece := connection.recv(1 << 20):
                    got.append(piece)
            except ConnectionResetError:
                pass
            return Answer(b"".join(got))

    def mask(self, scene, parts=None):
        return self.send(post("/v1/masks", form(scene, parts)))

    def get(self, path):
        return self.send(request("GET", path))

    def metric(self, name):
        found = re.search(rf"^{re.escape(name)} (\S+)$", self.get("/metrics").body.decode(), re.M)
        return float(found.group(1)) if found else None

    # --- What its processes take ---

    def workers(self):
        """Their process ids."""
        try:
            with open(f"/proc/{self.pid}/task/{self.pid}/children") as file:
                main = [int(word) for word in file.read().split()]
        except OSError:
            return []
        others = []
        for task in os.listdir(f"/proc/{self.pid}/task"):
            try:
                with open(f"/proc/{self.pid}/task/{task}/children") as file:
                    others += [int(word) for word in file.read().split()]
            except OSError:
                pass
        return sorted({*main, *others})

    def resident(self):
        """Bytes that front and workers have in memory together; what they share (files in memory, libraries) counts once."""
        return sum(proportional(process) for process in [self.pid, *self.workers()])

    def descriptors(self, process=None):
        return len(os.listdir(f"/proc/{process or self.pid}/fd"))


class Service(Visitor):
    """Runs until it goes; its standard error is read all the time."""

    def __init__(self, program, *options):
        super().__init__(0, 0)
        self.lines, self.ready = [], threading.Event()
        self.process = subprocess.Popen([program, "--port", "0", *map(str, options)], stderr=subprocess.PIPE, text=True, errors="replace")
        self.pid = self.process.pid
        threading.Thread(target=self._read, daemon=True).start()
        if not self.ready.wait(600) or not self.port:
            raise SystemExit("the service did not get ready:\n" + "\n".join(self.lines))

    def _read(self):
        for line in self.process.stderr:
            self.lines.append(line.rstrip("\n"))
            if found := re.search(r"listening on .* port (\d+)", line):
                self.port = int(found.group(1))
            if line == "ready\n":
                self.ready.set()
        self.ready.set()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        self.code = self.process.wait(60)


def proportional(process):
    try:
        with open(f"/proc/{process}/smaps_rollup") as file:
            return sum(int(line.split()[1]) * 1024 for line in file if line.startswith("Pss:"))
    except (OSError, ProcessLookupError):
        return 0


class Peak:
    """The most of a service's resident memory while this lives, looked at every 20 ms."""

    def __init__(self, service):
        self.service, self.bytes, self.over = service, 0, threading.Event()
        self.thread = threading.Thread(target=self._watch, daemon=True)

    def _watch(self):
        while True:
            self.bytes = max(self.bytes, self.service.resident())
            if self.over.wait(0.02):
                return

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.over.set()
        self.thread.join()
