"""Random extreme scenes, all techniques and lights, through the service's workers: each answer is a mask within [0, 1], or a problem that says why.

    extremes.py SERVER [--count N] [--first N] [--seed N]

N: 200, or 100000 with PENUMBRA_HOSTILE=long in the environment. A failure names the number that makes its scene again. Exit: 0 all held, 1 not.

A 504 is an answer. A worker that did not stop at the deadline is a fault where the scene, sent again while nothing else is, does so again: half a
second of grace may pass without a machine that does other things too.
"""

import argparse
import collections
import concurrent.futures
import json
import os
import struct
import sys
import time

import scenes
from service import Service, form, post, request

PROBLEMS = {400, 404, 406, 413, 422, 504}
DEADLINE = 10


def wrong_with_mask(data):
    """Of a float map; nothing when all of it lies within [0, 1]."""
    kind, size, scale, values = data.split(b"\n", 3)
    width, height = map(int, size.split())
    count = width * height * (3 if kind == b"PF" else 1)
    if len(values) != 4 * count or float(scale) >= 0:
        return f"a mask of {width} x {height} in {len(values)} bytes"
    for value in struct.unpack(f"<{count}f", values):
        if not 0 <= value <= 1:
            return f"visibility {value}"
    return ""


def wrong_with(answer, bound=False):
    if answer.status == 200:
        return "" if bound else wrong_with_mask(answer.body)
    problem = answer.problem
    if answer.status not in PROBLEMS:
        return str(answer)
    detail = problem.get("detail", "")
    if not problem.get("reason") or not detail or "\n" in detail or len(detail) > 4100:
        return f"a problem without reason or detail, or of many lines: {answer.body[:300]}"
    return ""


def text_of(scene):
    return json.dumps(scene)  # NaN and Infinity as such: no JSON, and to be refused


def scene_number(service, techniques, seed, number):
    """Status and what is wrong, of each answer to it."""
    maker = scenes.Maker(techniques, seed, number)
    scene, parts = maker.scene(), maker.parts
    body = form(text_of(scene), parts)
    choice = maker.random.random()
    if choice < 0.04:
        answer = service.send(post("/v1/masks?image=bound", body, "image/x-exr"))
        return [(answer.status, wrong_with(answer, bound=True))]
    if choice < 0.8:
        answer = service.send(post("/v1/masks", body))
        return [(answer.status, wrong_with(answer))]
    kept = service.send(post("/v1/scenes", body))
    if kept.status not in (200, 201):
        return [(kept.status, wrong_with(kept))]
    path = "/v1/scenes/" + json.loads(kept.body)["id"]
    results = []
    for _ in range(2):
        patch = text_of(maker.patch()).encode()
        if maker.parts:
            answer = service.send(post(path + "/masks", form(patch, maker.parts)))
        else:
            answer = service.send(post(path + "/masks", patch, content="application/json"))
        results.append((answer.status, wrong_with(answer)))
    service.send(request("DELETE", path))
    return results


def main():
    long = os.environ.get("PENUMBRA_HOSTILE") == "long"
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("server")
    arguments.add_argument("--count", type=int, default=100000 if long else 200)
    arguments.add_argument("--first", type=int, default=0)
    arguments.add_argument("--seed", type=int, default=1)
    options = arguments.parse_args()
    counts, failures, late, begun = collections.Counter(), [], [], time.monotonic()
    with Service(options.server, "--deadline-s", DEADLINE) as service, concurrent.futures.ThreadPoolExecutor(2) as clients:
        techniques = json.loads(service.get("/v1/techniques").body)["techniques"]

        def one(number):
            try:
                return number, scene_number(service, techniques, options.seed, number)
            except (OSError, ValueError, struct.error) as error:
                return number, [(0, f"{type(error).__name__}: {error}")]

        numbers = iter(range(options.first, options.first + options.count))
        for number, results in clients.map(one, numbers):
            for status, wrong in results:
                counts[status] += 1
                if status == 504:
                    late.append(number)
                if wrong:
                    failures.append(number)
                    print(f"extremes: --seed {options.seed} --first {number} --count 1: {wrong}", file=sys.stderr, flush=True)
        crashed, overdue = (int(service.metric(f"penumbra_workers_{what}_total")) for what in ("crashed", "overdue"))
        if overdue:
            for number in sorted(set(late)):
                one(number)
            again = int(service.metric("penumbra_workers_overdue_total")) - overdue
            if again:
                failures.append(late)
                print(f"extremes: --seed {options.seed}, of {sorted(set(late))}: {again} workers did not stop at the deadline", file=sys.stderr, flush=True)
    seconds = time.monotonic() - begun
    print(f"{options.count} scenes from {options.first} of seed {options.seed}, {sum(counts.values())} answers in {seconds:.0f} s: "
          + ", ".join(f"{count} times {status}" for status, count in sorted(counts.items())) + f"; {crashed} workers crashed, {overdue} were overdue" + (f"; over the {DEADLINE} s: {late[:20]}" if late else ""))
    if not counts[200] or service.code != 0:
        print(f"extremes: {counts[200]} masks, exit code {service.code}", file=sys.stderr)
        return 1
    return 1 if failures or crashed else 0


if __name__ == "__main__":
    sys.exit(main())
