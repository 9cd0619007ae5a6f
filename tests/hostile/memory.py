"""What requests of little size can make the service take: a table of the most resident memory that each of them led to.

    memory.py SERVER [--memory MIB]

Front and workers together have to stay below --memory; every request has to be refused with a reason, or answered; none may end a worker, and honest
requests beside them have to succeed. Prints a Markdown table. Exit: 0 all of that held, 1 not.
"""

import argparse
import concurrent.futures
import sys
import time

import bombs
from service import Peak, Service, form, post, request

REFUSED = {413, 422, 503}


def sent(service, scenes):
    """All at once, an honest request among them; what came back."""
    with concurrent.futures.ThreadPoolExecutor(len(scenes) + 1) as clients:
        hostile = [clients.submit(service.mask, *scene) for scene in scenes]
        honest = clients.submit(service.mask, bombs.HONEST)
        return [answer.result() for answer in hostile], honest.result()


def cases():
    layer, square, small = bombs.tiff(4096, 4096), bombs.png(4096, 4096, 30000), bombs.png(1024, 1024, 30000)
    splits, parts = bombs.splits()
    return [
        ("256 tables of 64^4 floats", [bombs.tables()]),
        ("two of 15 TIFF layers, 4096 x 4096", [bombs.layers(layer)] * 2),
        ("two of 2 depth objects, 4096 x 4096", [bombs.depth_objects(square)] * 2),
        ("a map of 2048 x 2048 as casters, 16 parts", [bombs.splits()]),
        ("the same, 1024 x 1024", [(splits, {**parts, "a.png": small})]),
        ("an EXR of 60 000 channels", [bombs.channels(60000)]),
    ]


def keep_many(service, count=48):
    """Scenes of 2 MiB, no two alike; how many of them were taken."""
    kept = 0
    for number in range(count):
        scene, parts = bombs.maps(512, number)
        kept += service.send(post("/v1/scenes", form(scene, parts))).status == 201
    return kept


def take_no_answers(service, count=30):
    """Clients that ask for masks of 4 MiB and read nothing; the connections."""
    scene = bombs.quads({"kind": "shadow_map"}, 64, 1024)
    connections = []
    for _ in range(count):
        connection = service.connect()
        connection.sendall(post("/v1/masks", form(scene)))
        connections.append(connection)
        while service.metric("penumbra_requests_admitted") > 1:
            time.sleep(0.01)
    return connections


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("server")
    arguments.add_argument("--memory", type=int, default=1500)
    options = arguments.parse_args()
    wrong = []
    print(f"| with `--memory` {options.memory} MiB | bytes sent | answer | s | MiB, at most |\n| --- | --- | --- | --- | --- |", flush=True)

    def row(name, size, answer, seconds, peak):
        print(f"| {name} | {size} | {answer} | {seconds:.1f} | {peak.bytes >> 20} |", flush=True)
        if peak.bytes > options.memory << 20:
            wrong.append(f"{name}: {peak.bytes >> 20} MiB")

    def check(holds, what):
        if not holds:
            wrong.append(what)

    with Service(options.server, "--memory", options.memory << 20) as service:
        for name, scenes in cases():
            begun = time.monotonic()
            with Peak(service) as peak:
                answers, honest = sent(service, scenes)
            size = sum(len(form(*scene)) for scene in scenes)
            row(name, size, answers[0], time.monotonic() - begun, peak)
            check(all(answer.status in REFUSED and answer.reason and answer.problem.get("detail") for answer in answers), f"{name}: {[str(a) for a in answers]}")
            check(honest.status == 200, f"beside {name}: {honest}")
            check(all(len(answer.body) < 8192 for answer in answers), f"{name}: a long text")

        begun = time.monotonic()
        with Peak(service) as peak:
            kept = keep_many(service)
        row("48 kept scenes of 2 MiB", 48 << 21, f"{kept} times 201", time.monotonic() - begun, peak)
        check(kept == 48, f"{kept} of 48 scenes were kept")
        begun = time.monotonic()
        with Peak(service) as peak:
            connections = take_no_answers(service)
            honest = service.mask(bombs.HONEST)
        row("30 masks of 4 MiB that nobody takes", 30 * 1000, honest, time.monotonic() - begun, peak)
        check(honest.status == 200, f"beside slow clients: {honest}")
        for connection in connections:
            connection.close()
        crashed = service.metric("penumbra_workers_crashed_total")
        check(crashed == 0, f"{crashed} workers ended")
        check(service.send(request("GET", "/healthz")).status == 200, "it does not answer any more")
    check(service.code == 0, f"exit code {service.code}")
    for line in wrong:
        print("memory: " + line, file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
