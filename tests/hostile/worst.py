"""The most time, memory and descriptors that one request takes: a Markdown table of bounds, and of what a request that provokes each of them took.

    worst.py SERVER

Exit: 0 when nothing was over its bound.
"""

import os
import signal
import sys
import threading
import time

import bombs
from service import Answer, Peak, Service, form, post, proportional, request

DEADLINE, GRACE, HEADERS, CONNECTIONS, MEMORY, SLOTS = 2, 0.5, 1, 64, 1500, 2
PATIENT = 20  # seconds of the service that is to decode much
BUSY = 1.0  # seconds that a loaded machine may take to look
MIB = 1 << 20

LONG = bombs.endless(256)


def asked(service, data):
    """A request on its way, and a function that waits for its answer and gives it with the seconds since."""
    begun, got = time.monotonic(), []
    thread = threading.Thread(target=lambda: got.append(service.send(data)))
    thread.start()

    def wait():
        thread.join()
        return got[0], time.monotonic() - begun

    return wait


def wait_for(condition, what, seconds=20):
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise SystemExit("worst: waited in vain for " + what)
        time.sleep(0.005)


def busy_worker(service):
    """The process of the worker that computes, when one does."""

    def used(process):
        with open(f"/proc/{process}/stat") as file:
            fields = file.read().rsplit(")", 1)[1].split()
        return int(fields[11]) + int(fields[12])

    wait_for(lambda: service.metric('penumbra_workers{state="busy"}') == 1, "a busy worker")
    before = {process: used(process) for process in service.workers()}
    while True:
        for process, ticks in before.items():
            if used(process) > ticks + 5:
                return process
        time.sleep(0.01)


def computing(service):
    answer, seconds = asked(service, post("/v1/masks", form(*LONG)))()
    return answer, seconds, DEADLINE + BUSY


def hanging(service):
    """Its worker stands still, as in a loop that nobody looks into."""
    wait = asked(service, post("/v1/masks", form(*LONG)))
    os.kill(busy_worker(service), signal.SIGSTOP)
    return *wait(), DEADLINE + GRACE + BUSY


def without_end(service, data):
    """Sends that much and waits."""
    begun = time.monotonic()
    with service.connect() as connection:
        connection.sendall(data)
        got = b""
        while piece := connection.recv(65536):
            got += piece
    return Answer(got), time.monotonic() - begun


def headers(service):
    return *without_end(service, b"POST /v1/masks HTTP/1.1\r\nHost: 127.0.0.1\r\n"), HEADERS + BUSY


def body(service):
    return *without_end(service, post("/v1/masks", form(bombs.HONEST))[:-100]), DEADLINE + BUSY


class Table:
    def __init__(self):
        self.wrong = []
        print("| the most of | bound | measured | answer |\n| --- | --- | --- | --- |")

    def row(self, what, bound, measured, unit="", note=""):
        text = (lambda number: f"{number:.1f} {unit}") if unit == "s" else lambda number: f"{number} {unit}".strip()
        print(f"| {what} | {text(bound)} | {text(measured)} | {note} |", flush=True)
        self.expect(measured <= bound, f"{what}: {measured} {unit}")

    def expect(self, holds, what):
        if not holds:
            self.wrong.append(what)


def times(service, table):
    for name, provoke, statuses in [("time: work that looks at the clock", computing, {413, 504}), ("time: a worker that hangs", hanging, {504}),
                                    ("time: headers that stop", headers, {408}), ("time: a body that stops", body, {408})]:
        answer, seconds, bound = provoke(service)
        table.row(name, bound, seconds, "s", f"{answer.status} {answer.reason}")
        table.expect(answer.status in statuses, f"{name}: {answer}")
    wait_for(lambda: service.metric('penumbra_workers{state="idle"}') == SLOTS, "workers that are ready again")


def descriptors(service, table):
    """With every connection taken."""
    guests = [service.connect() for _ in range(2 * CONNECTIONS)]
    wait_for(lambda: service.descriptors() >= CONNECTIONS, "connections")
    table.row("descriptors of the service itself", CONNECTIONS + 512, service.descriptors())
    for guest in guests:
        guest.close()
    table.row("descriptors of a worker", 64, max(service.descriptors(worker) for worker in service.workers()))
    table.expect(service.mask(bombs.HONEST).status == 200, "an honest request after all that")


def memory(service, table):
    """Of the service itself by the largest bodies, of workers by the images that they decode, all at once."""
    most, over = {"front": 0, "worker": 0}, threading.Event()

    def watch():
        while not over.wait(0.01):
            most["front"] = max(most["front"], proportional(service.process.pid) // MIB)
            most["worker"] = max([most["worker"], *(proportional(worker) // MIB for worker in service.workers())])

    large = request("POST", "/v1/masks", b"--B\r\n" + bytes(60 * MIB), ["Content-Type: multipart/form-data; boundary=B"])
    scene = post("/v1/masks", form(*bombs.layers(bombs.tiff(4096, 4096))))
    watcher = threading.Thread(target=watch)
    with Peak(service) as peak:
        watcher.start()
        layers = [asked(service, scene) for _ in range(SLOTS)]
        answers = [wait()[0] for wait in [asked(service, large) for _ in range(6)]]
        refused = [wait()[0] for wait in layers]
        over.set()
        watcher.join()
    share = MEMORY * 3 // 4 // SLOTS
    table.row("memory of a worker: its share, and libraries", share + 128, most["worker"], "MiB", f"{refused[0].status} {refused[0].reason}")
    table.row("memory of the service itself", MEMORY // 4, most["front"], "MiB", ", ".join(sorted({f"{a.status} {a.reason}" for a in answers})))
    table.row("memory in all", MEMORY, peak.bytes // MIB, "MiB")
    table.expect(all(answer.status == 413 for answer in refused), f"layers: {[str(a) for a in refused]}")
    table.expect(any(answer.reason == "memory" for answer in answers), f"bodies: {[str(a) for a in answers]}")


def main():
    table = Table()
    options = {"deadline-s": DEADLINE, "header-s": HEADERS, "connections": CONNECTIONS, "memory": MEMORY * MIB, "slots": SLOTS, "rays": 1 << 40}
    for changes, provoke in [({}, [times, descriptors]), ({"deadline-s": PATIENT}, [memory])]:
        with Service(sys.argv[1], *(f"--{name}={value}" for name, value in {**options, **changes}.items())) as service:
            for one in provoke:
                one(service, table)
        table.expect(service.code == 0, f"exit code {service.code}")
    for line in table.wrong:
        print("worst: " + line, file=sys.stderr)
    return 1 if table.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
