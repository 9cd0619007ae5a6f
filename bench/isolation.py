"""What it costs that masks are made in processes of their own: the client's time from request to answer, less what the stages took.

    bench/isolation.py [SERVER] [REQUESTS]

Masks of 512 x 512 receivers as PNG and as PFM (1 MiB), of a scene without maps and of one with two float maps (2 MiB). Decode, compute and encode are
those of the service's log. The rest is connecting, the body through a socket into shared memory, waits, the call to the worker and back, and the answer.
Prints a Markdown table.
"""

import json
import pathlib
import statistics
import sys
import time

root = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(root / "tests" / "hostile"))

import bombs  # noqa: E402
from service import Service, form, post  # noqa: E402


def logged(service, request_id):
    """Its line: it comes after the answer."""
    for _ in range(2000):
        for line in reversed(service.lines[-8:]):
            if line.startswith("{") and f'"{request_id}"' in line:
                return json.loads(line)
        time.sleep(0.0005)
    raise SystemExit("isolation: no line in the log for " + request_id)


PNG, PFM = "image/png", "image/x-portable-floatmap"
CASES = {
    "quads to PNG": ((bombs.quads({"kind": "shadow_map"}, 256, 512), {}), PNG),
    "quads to PFM": ((bombs.quads({"kind": "shadow_map"}, 256, 512), {}), PFM),
    "two maps to PFM": (bombs.maps(512, 0), PFM),
}


def run(service, name, requests):
    scene, accept = CASES[name]
    data = post("/v1/masks", form(*scene), accept)
    totals, stages, uploads, handing, rests = [], [], [], [], []
    for number in range(requests + 20):
        begun = time.perf_counter()
        answer = service.send(data)
        total = 1000 * (time.perf_counter() - begun)
        line = logged(service, answer.headers["x-request-id"])
        if answer.status != 200:
            raise SystemExit(f"isolation: {answer}")
        if number < 20:
            continue
        inside = line["decode_ms"] + line["compute_ms"] + line["encode_ms"]
        for values, value in [(totals, total), (stages, inside), (uploads, line["upload_ms"]), (handing, line["worker_ms"] - inside), (rests, total - inside)]:
            values.append(value)
    print(f"| {name} | " + " | ".join(f"{statistics.median(values):.2f}" for values in (totals, stages, handing, uploads, rests)) + f" | {min(rests):.2f} |", flush=True)


def main():
    program = sys.argv[1] if len(sys.argv) > 1 else str(root / "build" / "release" / "server" / "penumbra-server")
    requests = int(sys.argv[2]) if len(sys.argv) > 2 else 200
    print("| | total, ms: median | decode, compute, encode | to the worker and back | upload | all beside the stages | least |\n| --- | --- | --- | --- | --- | --- | --- |")
    with Service(program) as service:
        for name in CASES:
            run(service, name, requests)


if __name__ == "__main__":
    main()
