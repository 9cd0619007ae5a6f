"""Sends good and hostile requests, byte by byte, to a service and to the proxies before it (try_proxies.sh starts them all).

Prints a Markdown table of what came back; compares it with the one in the page that --docs names. Exit: 0 equal, 1 not.
"""

import argparse
import json
import os
import re
import signal
import socket
import struct
import sys
import threading
import time

LIMIT = 64 << 20  # --body-bytes
PLACES = 18  # --slots + --queue

# --- One exchange ------------------------------------------------------------------------------------------------------------------


class Answer:
    """What came back on one connection, until it closed or nothing came for `quiet` seconds."""

    def __init__(self, data, seconds, reset):
        self.data, self.seconds, self.reset = data, seconds, reset
        final = re.sub(rb"HTTP/1\.1 100 [^\r]*\r\n\r\n", b"", data)
        self.statuses = [int(s) for s in re.findall(rb"HTTP/1\.[01] (\d{3}) ", final)]
        self.status = self.statuses[0] if self.statuses else 0
        head, _, rest = final.partition(b"\r\n\r\n")
        length = re.search(rb"\r\nContent-Length: (\d+)", head, re.I)
        self.head, self.body = head, rest[: int(length.group(1))] if length else rest

    def __str__(self):
        return str(self.status) if self.status else "reset" if self.reset else "closed"


def connect(port):
    return socket.create_connection(("127.0.0.1", port), timeout=60)


def receive(connection, begun, quiet=60.0):
    data, reset = b"", False
    connection.settimeout(quiet)
    try:
        while got := connection.recv(65536):
            data += got
    except (ConnectionResetError, BrokenPipeError):
        reset = True
    except TimeoutError:
        pass
    connection.close()
    return Answer(data, time.monotonic() - begun, reset)


def exchange(port, *pieces, pause=0.0, quiet=60.0):
    """Sends the pieces, with a pause after each; stops sending when the other side has closed."""
    begun = time.monotonic()
    connection = connect(port)
    try:
        for piece in pieces:
            connection.sendall(piece)
            if pause:
                time.sleep(pause)
    except (ConnectionResetError, BrokenPipeError):
        pass  # what it said before is still to be read
    return receive(connection, begun, quiet)


# --- Requests ----------------------------------------------------------------------------------------------------------------------


def pfm(size, depth_at):
    rows = [struct.pack(f"<{size}f", *[depth_at(x, y) for x in range(size)]) for y in reversed(range(size))]
    return b"Pf\n%d %d\n-1.0\n" % (size, size) + b"".join(rows)


def scene_form(size=128):
    camera = {"kind": "light", "tan_half_fov": [1, 1]}
    scene = {
        "penumbra": 1,
        "light": {"kind": "rectangle", "center": [0, 0, 0], "half_u": [0.25, 0, 0], "half_v": [0, 0, -0.25]},
        "occluders": {"camera": camera, "depth": {"front": "front.pfm"}},
        "receivers": {"camera": camera, "depth": "floor.pfm"},
        "technique": {"kind": "soft_shadow_map", "sides": "front"},
    }
    inside = range(size // 4, size * 3 // 4)
    parts = {
        "scene": json.dumps(scene).encode(),
        "front.pfm": pfm(size, lambda x, y: 1.0 if x in inside and y in inside else float("inf")),
        "floor.pfm": pfm(size, lambda x, y: 2.0),
    }
    body = b""
    for name, data in parts.items():
        body += b'--B\r\nContent-Disposition: form-data; name="%s"; filename="x"\r\n\r\n%s\r\n' % (name.encode(), data)
    return body + b"--B--\r\n"


class Target:
    """One port, and the requests that are sent to it."""

    def __init__(self, name, port, service_port, token):
        self.name, self.port, self.service_port, self.token = name, port, service_port, token

    def head(self, method, path, *headers, token=None, host="gateway.example", close=True):
        lines = [f"{method} {path} HTTP/1.1"] + ([f"Host: {host}"] if host else [])
        lines += [f"Authorization: Bearer {self.token if token is None else token}"]
        lines += ["Connection: close"] * close + list(headers)
        return ("\r\n".join(lines) + "\r\n\r\n").encode()

    def get(self, path, *headers, **options):
        return exchange(self.port, self.head("GET", path, *headers, **options))

    def post(self, path, body, *headers, **options):
        return exchange(self.port, self.head("POST", path, *FORM, f"Content-Length: {len(body)}", *headers, **options) + body)

    def metric(self, name):
        text = Target("", self.service_port, self.service_port, self.token).get("/metrics").body.decode()
        return int(float(re.search(rf"^{name} (\S+)$", text, re.M).group(1)))


FORM = ("Content-Type: multipart/form-data; boundary=B", "Accept: image/x-portable-floatmap")
BODY = scene_form()
PATCH = b'{"light": {"half_u": [0.5, 0, 0], "half_v": [0, 0, -0.5]}}'
EXPECTED = {}  # the direct answers' bytes


def same_bytes(name, answer):
    return "the same bytes" if EXPECTED.setdefault(name, answer.body) == answer.body and answer.body else "other bytes"


def chunks(body, size=1 << 20):
    for at in range(0, len(body), size):
        piece = body[at : at + size]
        yield b"%x\r\n%s\r\n" % (len(piece), piece)
    yield b"0\r\n\r\n"


# --- What is tried: each gives a cell of the table ---------------------------------------------------------------------------------


def mask(t):
    answer = t.post("/v1/masks", BODY)
    return f"{answer}, {same_bytes('mask', answer)}"


def kept_scene(t):
    kept = t.post("/v1/scenes", BODY)
    path = "/v1/scenes/" + json.loads(kept.body)["id"]
    json_type = ("Content-Type: application/json", "Accept: image/x-portable-floatmap", f"Content-Length: {len(PATCH)}")
    made = exchange(t.port, t.head("POST", path + "/masks", *json_type) + PATCH)
    gone = exchange(t.port, t.head("DELETE", path))
    return f"{kept}, {made}, {gone}; {same_bytes('kept', made)}"


def expect_continue(t):
    begun = time.monotonic()
    connection = connect(t.port)
    connection.sendall(t.head("POST", "/v1/masks", *FORM, f"Content-Length: {len(BODY)}", "Expect: 100-continue"))
    if not connection.recv(64).startswith(b"HTTP/1.1 100 "):
        return "no 100"
    connection.sendall(BODY)
    answer = receive(connection, begun)
    return f"100, {answer.statuses[-1]}"


def early_answer(t):
    body = b"x" * (2 << 20)  # the service reads and forgets 4 MiB of what it refused; beyond, the answer may be lost on the way
    begun = time.monotonic()
    connection = connect(t.port)
    request = t.head("POST", "/v1/masks", *FORM, f"Content-Length: {len(body)}", token="wrong") + body
    sender = threading.Thread(target=send_quietly, args=(connection, request))
    sender.start()
    answer = receive(connection, begun)
    sender.join()
    whole = b'"reason":"token"' in answer.body
    return f"{answer}, {'whole' if whole else 'not whole'}"


def send_quietly(connection, data):
    try:
        connection.sendall(data)
    except OSError:
        pass  # the answer says it


def request_in_body(t):
    inner = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"
    request = t.head("POST", "/v1/masks", *FORM, f"Content-Length: {len(inner)}", token="wrong", close=False) + inner
    answer = exchange(t.port, request, quiet=2.0)
    return f"{answer}, {len(answer.statuses)} answer{'s' * (len(answer.statuses) != 1)}"


def chunked(t):
    head = t.head("POST", "/v1/masks", *FORM, "Transfer-Encoding: chunked")
    return str(exchange(t.port, head, *chunks(BODY)))


def chunked_over(t):
    head = t.head("POST", "/v1/masks", *FORM, "Transfer-Encoding: chunked")
    return str(exchange(t.port, head, *chunks(b"x" * (LIMIT + (1 << 20)))))


def length_over(t):
    return str(exchange(t.port, t.head("POST", "/v1/masks", *FORM, f"Content-Length: {LIMIT + 1}"), b"x" * 65536))


def lengths(*values):
    def check(t):
        length = len(BODY)
        headers = [f"Content-Length: {length + value}" for value in values]
        return str(exchange(t.port, t.head("POST", "/v1/masks", *FORM, *headers) + BODY))

    return check


def length_and_chunked(t):
    headers = (*FORM, "Content-Length: 5", "Transfer-Encoding: chunked")
    answer = exchange(t.port, t.head("POST", "/v1/masks", *headers, close=False), b"0\r\n\r\nGET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n", quiet=2.0)
    return ", then ".join(str(status) for status in answer.statuses) or str(answer)


def twice_encoded(t):
    headers = (*FORM, "Transfer-Encoding: gzip, chunked")
    return str(exchange(t.port, t.head("POST", "/v1/masks", *headers), b"0\r\n\r\n"))


def many_headers(t):
    return str(t.get("/healthz", *[f"X-{i}: 1" for i in range(20000)]))


def long_line(t):
    return str(t.get("/" + "x" * 100000))


def slow_headers(t):
    begun = time.monotonic()
    connection = connect(t.port)
    connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nX: ")
    ended = threading.Event()

    def trickle():
        while not ended.wait(0.5):
            send_quietly(connection, b"x")

    thread = threading.Thread(target=trickle)
    thread.start()
    answer = receive(connection, begun, 30)
    ended.set()
    thread.join()
    return f"{answer}, within 8 s" if answer.seconds < 8 else f"{answer}, later"


def stalled_bodies(sent):
    """24 clients, more than there are places, stop after `sent` bytes: what is left for others, and how they end."""

    def check(t):
        stalled = []
        for _ in range(PLACES + 6):
            connection = connect(t.port)
            connection.sendall(t.head("POST", "/v1/masks", *FORM, f"Content-Length: {len(BODY)}") + BODY[:sent])
            stalled.append((connection, time.monotonic()))
        time.sleep(1)
        admitted = t.metric("penumbra_requests_admitted")
        good = t.post("/v1/masks", BODY)
        answers = {str(receive(*one, 60)) for one in stalled}
        after = t.post("/v1/masks", BODY)
        return f"{admitted} places taken, a mask meanwhile {good}, they end with {' or '.join(sorted(answers))}, a mask after {after}"

    return check


def rule(*headers, path="/v1/techniques", **options):
    return lambda t: str(t.get(path, *headers, **options))


def gone(t):
    """Last: the service has ended."""
    try:
        return str(t.get("/healthz"))
    except ConnectionRefusedError:
        return "refused"
    except ConnectionResetError:
        return "reset"  # it was about to end


CHECKS = {
    "a mask, 128 KiB of PFM": mask,
    "a scene is kept, a mask of it with another light, it is deleted": kept_scene,
    "`Expect: 100-continue`, a mask": expect_continue,
    "wrong token, 2 MiB of body: the answer comes before the body is read": early_answer,
    "wrong token, a request inside the body": request_in_body,
    "chunked body": chunked,
    "chunked body over the limit": chunked_over,
    "`Content-Length` over the limit": length_over,
    "two `Content-Length`, the same": lengths(0, 0),
    "two `Content-Length`, different": lengths(0, 1),
    "`Content-Length` and chunked, a request behind": length_and_chunked,
    "`Transfer-Encoding: gzip, chunked`": twice_encoded,
    "`Content-Encoding: gzip`": lambda t: str(t.post("/v1/masks", BODY, "Content-Encoding: gzip")),
    "`Range: bytes=0-3`": rule("Range: bytes=0-3"),
    "20 000 headers": many_headers,
    "request line of 100 kB": long_line,
    "headers that trickle": slow_headers,
    "24 bodies that stop after 8 KiB": stalled_bodies(8 << 10),
    "24 bodies that stop after 64 KiB": stalled_bodies(64 << 10),
    "`Host: gateway.example`, in `--names`": rule(),
    "`Host: elsewhere.example`": rule(host="elsewhere.example"),
    "two `Host`": rule("Host: localhost"),
    "no `Host`": rule(host=None),
    "`Origin: http://gateway.example`": rule("Origin: http://gateway.example"),
    "`Origin: https://elsewhere.example`": rule("Origin: https://elsewhere.example"),
    "no token": rule(token=""),
    "`/metrics`, with the token": rule(path="/metrics"),
}


# --- The table ---------------------------------------------------------------------------------------------------------------------


def table_of(targets, rows):
    head = "| request | " + " | ".join(t.name for t in targets) + " |"
    lines = [head, "| --- " * (len(targets) + 1) + "|"]
    return lines + ["| " + " | ".join([name, *cells]) + " |" for name, cells in rows]


def documented(page):
    """The table that stands in the page between its two marks."""
    with open(page, encoding="utf-8") as file:
        text = file.read()
    found = re.search(r"<!-- try_proxies -->\n(.*?)\n<!-- end -->", text, re.S)
    return found.group(1).splitlines() if found else []


def wait_until_listening(port):
    for _ in range(200):
        try:
            return connect(port).close()
        except ConnectionRefusedError:
            time.sleep(0.05)
    sys.exit(f"try_proxies: nobody listens on port {port}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--token", required=True)
    parser.add_argument("--service-process", type=int, required=True)
    parser.add_argument("--docs", required=True)
    parser.add_argument("targets", nargs="+", metavar="NAME=PORT", help="the first is the service itself")
    options = parser.parse_args()
    ports = [target.split("=") for target in options.targets]
    targets = [Target(name, int(port), int(ports[0][1]), options.token) for name, port in ports]
    for target in targets:
        wait_until_listening(target.port)

    rows = [(name, [check(target) for target in targets]) for name, check in CHECKS.items()]
    os.kill(options.service_process, signal.SIGTERM)
    while gone(targets[0]) != "refused":
        time.sleep(0.1)
    rows.append(("the service has ended", [gone(target) for target in targets]))

    table = table_of(targets, rows)
    print("\n".join(table))
    expected = documented(options.docs)
    differences = [f"page: {line}" for line in expected if line not in table] + [f"here: {line}" for line in table if line not in expected]
    if differences:
        print(f"try_proxies: not as {options.docs} says:\n" + "\n".join(differences), file=sys.stderr)
        sys.exit(1)


main()
