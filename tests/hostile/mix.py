"""Honest requests among hostile ones: bombs, endless work, broken images, workers that are killed, slow clients.

    mix.py SERVER [--seconds N] [--slow] [--log FILE]

First a quiet time, a sixth of it, then the mix. Honest masks have to keep their bits; only the request that a killed worker had may be lost, and what
is refused for want of places or memory is asked again. Memory must not rise. Prints a Markdown table. Exit: 0 all held, 1 not.

N: 8, or 600 with PENUMBRA_HOSTILE=long in the environment. --slow names what the slowest honest requests waited for. What is hostile runs in a process of
its own: clients of one Python process wait for each other.
"""

import argparse
import collections
import json
import os
import random
import signal
import subprocess
import sys
import threading
import time

import bombs
from service import Service, Visitor, form, post

MEMORY = 4000  # MiB
SLOTS = 3
SPARES = 4  # for two loops, a bomb, and a worker that was killed


def honest_requests():
    """Of several techniques, each with what it is called."""
    scenes = {
        "soft_shadow_map": bombs.HONEST,
        "ray_traced": bombs.quads({"kind": "ray_traced", "samples": 16}),
        "soft_shadow_volume": bombs.quads({"kind": "soft_shadow_volume"}),
        "occlusion_texture": bombs.quads({"kind": "occlusion_texture"}),
    }
    requests = {name: post("/v1/masks", form(scene)) for name, scene in scenes.items()}
    requests["two maps"] = post("/v1/masks", form(*bombs.maps(256, 0)))
    return requests


class Honest:
    """One client, one request after the other; asks again where it is told to."""

    def __init__(self, service, seed):
        self.service, self.random = service, random.Random(seed)
        self.requests = honest_requests()
        self.bits, self.times, self.slow, self.counts, self.wrong = {}, [], [], collections.Counter(), []

    def run(self, until, expected=None):
        while time.monotonic() < until():
            name = self.random.choice(list(self.requests))
            begun = time.monotonic()
            answer = self.service.send(self.requests[name])
            self.times.append(time.monotonic() - begun)
            self.slow.append((self.times[-1], name, answer.status, answer.headers.get("server-timing", answer.reason)))
            self.counts[f"{answer.status} {answer.reason}".strip()] += 1
            if answer.status == 200:
                if answer.body != (expected or self.bits).setdefault(name, answer.body):
                    self.wrong.append(f"{name}: other bits")
            elif answer.reason not in ("queue_full", "memory", "crashed", "no_worker"):
                self.wrong.append(f"{name}: {answer}")


class Hostile:
    """Threads that do no good, until they are told to end."""

    def __init__(self, service):
        self.service, self.over, self.kills, self.counts = service, threading.Event(), 0, collections.Counter()
        layer, square = bombs.tiff(4096, 4096), bombs.png(4096, 4096, 30000)
        self.bombs = [post("/v1/masks", form(*scene)) for scene in
                      [bombs.tables(), bombs.layers(layer), bombs.depth_objects(square), bombs.splits(), bombs.channels(20000)]]
        self.broken = [post("/v1/masks", data) for data in (b"--B--\r\n", b"", form("{"), form(bombs.HONEST)[:-40])]
        self.threads = [threading.Thread(target=run, args=(random.Random(number),)) for number, run in
                        enumerate([self.send_bombs, self.send_loops, self.send_loops, self.send_broken, self.kill, self.be_slow])]

    def run(self):
        """Until standard input ends; then says what came of it."""
        for thread in self.threads:
            thread.start()
        sys.stdin.read()
        self.over.set()
        for thread in self.threads:
            thread.join()
        print(json.dumps({"kills": self.kills, "counts": self.counts}))

    def send(self, data):
        answer = self.service.send(data)
        self.counts[f"{answer.status} {answer.reason}".strip()] += 1

    def send_bombs(self, chance):
        while not self.over.wait(0.2):
            self.send(chance.choice(self.bombs))

    def send_loops(self, chance):
        while not self.over.wait(0.5):
            # No two alike: what happened to be under way in two killed workers would be refused from then on.
            self.send(post("/v1/masks", form(*bombs.endless(chance.choice((64, 128, 512)), chance.uniform(-1000, 1000)))))

    def send_broken(self, chance):
        while not self.over.wait(0.02):
            self.send(chance.choice(self.broken))

    def kill(self, chance):
        while not self.over.wait(chance.uniform(1, 3)):
            if workers := self.service.workers():
                try:
                    os.kill(chance.choice(workers), signal.SIGKILL)
                    self.kills += 1
                except ProcessLookupError:
                    pass

    def be_slow(self, chance):
        """Headers, bodies and answers that do not move."""
        held = []
        large = post("/v1/masks", form(bombs.quads({"kind": "shadow_map"}, 64, 1024)))
        while not self.over.wait(0.3):
            connection = self.service.connect()
            connection.sendall(chance.choice([b"GET /healthz HTTP/1.1\r\n", large[:-50], large]))
            held.append(connection)
            if len(held) > 40:
                held.pop(0).close()
        for connection in held:
            connection.close()


class HostileProcess:
    def __init__(self, service):
        self.process = subprocess.Popen([sys.executable, "-B", __file__, "--hostile", str(service.port), str(service.pid)], text=True,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        said = json.loads(self.process.communicate()[0])
        self.kills, self.counts = said["kills"], collections.Counter(said["counts"])


def percentile(times, share):
    ordered = sorted(times)
    return 1000 * ordered[min(len(ordered) - 1, int(share * len(ordered)))]


def watch(service, over, samples):
    while not over.wait(0.1):
        samples.append((time.monotonic(), service.resident() >> 20))


def measured(service, name, seconds, clients, expected, wrong):
    """Some clients at work for a while; a row of the table, and their memory samples."""
    honest, samples, over = [Honest(service, f"{name} {i}") for i in range(clients)], [], threading.Event()
    end = time.monotonic() + seconds
    threads = [threading.Thread(target=one.run, args=(lambda: end, expected)) for one in honest]
    watcher = threading.Thread(target=watch, args=(service, over, samples))
    for thread in [watcher, *threads]:
        thread.start()
    for thread in threads:
        thread.join()
    over.set()
    watcher.join()
    times, counts = [t for one in honest for t in one.times], sum((one.counts for one in honest), collections.Counter())
    for one in honest:
        wrong += one.wrong
    peak = max(size for _, size in samples)
    print(f"| {name} | {len(times)} | {', '.join(f'{n} times {what}' for what, n in counts.most_common())} | {percentile(times, 0.5):.1f} | "
          f"{percentile(times, 0.99):.1f} | {peak} |", flush=True)
    return counts, samples, percentile(times, 0.99), sorted((entry for one in honest for entry in one.slow), reverse=True)


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("server")
    arguments.add_argument("--seconds", type=float, default=600 if os.environ.get("PENUMBRA_HOSTILE") == "long" else 8)
    arguments.add_argument("--slow", action="store_true")
    arguments.add_argument("--log", help="where the service's standard error goes")
    options = arguments.parse_args()
    wrong, expected = [], {}
    print("| time | honest requests | answers | ms: median | 99 % | MiB, at most |\n| --- | --- | --- | --- | --- | --- |", flush=True)
    with Service(options.server, "--memory", MEMORY << 20, "--deadline-s", 15, "--rays", 1 << 40, "--slots", SLOTS, "--spares", SPARES) as service:
        while service.metric('penumbra_workers{state="idle"}') < SLOTS + SPARES:
            time.sleep(0.05)
        for name, data in honest_requests().items():
            expected[name] = service.send(data).body
        quiet, _, quiet_ms, _ = measured(service, "quiet", options.seconds / 6, 2, expected, wrong)
        with HostileProcess(service) as hostile:
            mixed, samples, mixed_ms, slow = measured(service, "mixed", options.seconds, 2, expected, wrong)
        after, _, _, _ = measured(service, "quiet again", options.seconds / 6, 2, expected, wrong)
        crashed, overdue = (int(service.metric(f"penumbra_workers_{what}_total")) for what in ("crashed", "overdue"))
        print(f"\n{hostile.kills} workers were killed, {crashed} ended by themselves or so, {overdue} were overdue. Hostile answers: "
              + ", ".join(f"{n} times {what}" for what, n in hostile.counts.most_common()) + ".")
        if crashed > hostile.kills:
            wrong.append(f"{crashed - hostile.kills} workers ended that nobody killed")
        # `crashed` is what became of the requests of killed workers, honest or not.
        lost = mixed["500 crashed"]
        if lost > hostile.kills:
            wrong.append(f"{lost} honest requests were lost by {hostile.kills} killed workers")
        if list(quiet) != ["200"] or list(after) != ["200"]:
            wrong.append(f"refused in quiet times: {dict(quiet)}, {dict(after)}")
        if options.slow:
            for seconds, *what in slow[: max(len(slow) // 50, 1)]:
                print(f"{1000 * seconds:.0f} ms:", *what)
        half = len(samples) // 2
        first, second = (max(size for _, size in part) for part in (samples[:half], samples[half:]))
        print(f"Resident memory, at most: {first} MiB in the first half of the mix, {second} MiB in the second.")
        if second > MEMORY or (options.seconds >= 60 and second > 1.25 * first):
            wrong.append(f"memory rose from {first} to {second} MiB")
    if options.log:
        with open(options.log, "w", encoding="utf-8") as file:
            file.write("\n".join(service.lines))
    if service.code != 0:
        wrong.append(f"exit code {service.code}")
    for line in sorted(set(wrong)):
        print("mix: " + line, file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    if sys.argv[1] == "--hostile":
        Hostile(Visitor(int(sys.argv[2]), int(sys.argv[3]))).run()
    else:
        sys.exit(main())
