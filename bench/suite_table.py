#!/usr/bin/env python3
"""The tables and the plot of docs/accuracy-and-cost.md, from the rows of `penumbra_bench suite`.

    bench/suite_table.py out/bench/suite.csv ratios      times faster than adaptive rays at equal error
    bench/suite_table.py out/bench/suite.csv scenes      the fastest setting of each scene that is good enough
    bench/suite_table.py out/bench/suite.csv settings    each setting's mean over the scenes
    bench/suite_table.py out/bench/suite.csv plot        an SVG of error over time

Time is preparing and shading, depth maps given; "with depth rendered" adds what the maps of the casters take, their hierarchy for rays included, as it is in the
rays' time. Errors are mean absolute ones over shadow pixels. Rays are those of the same run.
"""
import csv
import math
import sys
from collections import defaultdict

TARGETS = (0.02, 0.01, 0.005, 0.003)
SILENT = {("visibility", "union"), ("resolution", "0"), ("adaptive", "false")}
LEFT_OUT = {"preset", "sides", "reduction", "accumulator", "bias", "project", "project_resolution", "seed", "first_samples", "adaptive", "placement",
            "projection_centre", "prefilter", "storage", "combine", "leak_fix", "self_shadow", "coverage", "smooth", "corner_wedges", "overlap", "table", "lookup",
            "buffer", "culling", "t_from", "t", "falloff", "slices"}


def rows_of(path):
    """[{scene, technique, setting, adaptive, error, time, share}]"""
    with open(path, encoding="utf-8") as file:
        lines = [line for line in file if not line.startswith("#")]
    rows = []
    for row in csv.DictReader(lines):
        keys = dict(pair.split("=", 1) for pair in row["settings"].split())
        keys = {key: value for key, value in keys.items() if (key, value) not in SILENT}
        shown = " ".join(f"{key}={value}" for key, value in keys.items() if key not in LEFT_OUT or (key == "adaptive" and value == "true"))
        rows.append({"scene": row["scene"], "technique": row["technique"], "setting": shown, "rival": row["technique"] == "ray_traced" and float(keys.get("tolerance", 0)) == 0,
                     "error": float(row["mae_shadow"]), "time": float(row["prepare_ms"]) + float(row["shade_ms_median"]), "render": float(row["render_ms"]), "share": float(row["parameter"])})
    return rows


def mean(values):
    return math.exp(sum(math.log(value) for value in values) / len(values))


def rival_time(rows, error):
    """Milliseconds that adaptive rays take for an error: between measured ones on logarithmic axes; beyond, errors fall with the square root of time."""
    points = sorted((row["time"], row["error"]) for row in rows)
    front = []
    for time, err in points:
        if not front or err < front[-1][1]:
            front.append((time, err))
    if error >= front[0][1]:
        return front[0][0]
    for (t0, e0), (t1, e1) in zip(front, front[1:]):
        if e1 <= error <= e0:
            part = math.log(e0 / error) / math.log(e0 / e1)
            return t0 * (t1 / t0) ** part
    return front[-1][0] * (front[-1][1] / error) ** 2


def by_scene(rows):
    scenes = defaultdict(list)
    for row in rows:
        scenes[row["scene"]].append(row)
    return scenes


def best(rows, error, technique):
    fit = [row for row in rows if row["technique"] == technique and not row["rival"] and row["error"] <= error]
    return min(fit, key=lambda row: row["time"]) if fit else None


def ratios(rows):
    print("| mean absolute error over shadow pixels | " + " | ".join(f"{target:g}" for target in TARGETS) + " |")
    print("| --- |" + " --- |" * len(TARGETS))
    for technique, name in (("soft_shadow_map", "`soft_shadow_map`"), ("ray_traced", "`ray_traced` with `tolerance`")):
        found = []
        for target in TARGETS:
            factors = []
            for scene in by_scene(rows).values():
                row = best(scene, target, technique)
                if row:
                    factors.append(rival_time([r for r in scene if r["rival"]], target) / row["time"])
            found.append((factors, len(by_scene(rows)) - len(factors)))
        print(f"| {name}, times faster, geometric mean | " + " | ".join(f"{mean(f):.0f}" if f else "-" for f, _ in found) + " |")
        print(f"| {name}, least | " + " | ".join(f"{min(f):.1f}" if f else "-" for f, _ in found) + " |")
        print(f"| {name}, scenes that reach the error | " + " | ".join(f"{len(f)} of {len(f) + missed}" for f, missed in found) + " |")


def scenes(rows):
    print("| scene | error | setting of `soft_shadow_map` | its error | ms | with depth rendered, ms | adaptive rays, ms | times faster |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for name, scene in by_scene(rows).items():
        for target in TARGETS:
            row = best(scene, target, "soft_shadow_map")
            rays = rival_time([r for r in scene if r["rival"]], target)
            if row:
                print(f"| {name} | {target:g} | {row['setting']} | {row['error']:.4f} | {row['time']:.1f} | {row['time'] + row['render']:.0f} | {rays:.0f} | {rays / row['time']:.0f} |")
            else:
                print(f"| {name} | {target:g} | not reached | | | | {rays:.0f} | |")


def settings(rows):
    print("| technique | setting | mean error (geometric) | worst scene | share of receivers shaded | ms, geometric mean |")
    print("| --- | --- | --- | --- | --- | --- |")
    groups = defaultdict(list)
    for row in rows:
        groups[row["technique"], row["setting"]].append(row)
    for (technique, setting), group in groups.items():
        worst = max(group, key=lambda row: row["error"])
        print(f"| {technique} | {setting} | {mean([row['error'] for row in group]):.4f} | {worst['error']:.4f}, {worst['scene']} | "
              f"{sum(row['share'] for row in group) / len(group):.3f} | {mean([row['time'] for row in group]):.1f} |")


def plot(rows):
    groups = defaultdict(list)
    for row in rows:
        kind = "adaptive rays" if row["rival"] else row["technique"] + (" with tolerance" if row["technique"] == "ray_traced" else "")
        groups[kind, row["setting"]].append(row)
    points = defaultdict(list)
    for (kind, _), group in groups.items():
        points[kind].append((mean([row["time"] for row in group]), mean([row["error"] for row in group])))
    times = [time for line in points.values() for time, _ in line]
    errors = [error for line in points.values() for _, error in line]
    low_t, high_t = math.floor(math.log10(min(times))), math.ceil(math.log10(max(times)))
    low_e, high_e = math.floor(math.log10(min(errors))), math.ceil(math.log10(max(errors)))
    width, height, left, top, right, bottom = 860, 480, 70, 20, 220, 50

    def place(time, error):
        x = left + (math.log10(time) - low_t) / (high_t - low_t) * (width - left - right)
        y = top + (high_e - math.log10(error)) / (high_e - low_e) * (height - top - bottom)
        return x, y

    print(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="13">')
    print(f'<rect width="{width}" height="{height}" fill="white"/>')
    for decade in range(low_t, high_t + 1):
        x, _ = place(10.0 ** decade, 10.0 ** high_e)
        print(f'<path d="M{x:.1f} {top}V{height - bottom}" stroke="#ddd"/><text x="{x:.1f}" y="{height - bottom + 18}" text-anchor="middle">{10.0 ** decade:g} ms</text>')
    for decade in range(low_e, high_e + 1):
        _, y = place(10.0 ** low_t, 10.0 ** decade)
        print(f'<path d="M{left} {y:.1f}H{width - right}" stroke="#ddd"/><text x="{left - 8}" y="{y + 4:.1f}" text-anchor="end">{10.0 ** decade:g}</text>')
    colours = ["#d62728", "#1f77b4", "#ff7f0e", "#2ca02c", "#9467bd", "#8c564b", "#e377c2"]
    for number, (kind, line) in enumerate(sorted(points.items())):
        colour = colours[number % len(colours)]
        front = []
        for time, error in sorted(line):
            x, y = place(time, error)
            print(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{colour}"/>')
            if not front or error < front[-1][1]:
                front.append((time, error))
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in (place(*point) for point in front))
        print(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="2"/>')
        print(f'<circle cx="{width - right + 20}" cy="{top + 14 + 20 * number}" r="4" fill="{colour}"/><text x="{width - right + 30}" y="{top + 18 + 20 * number}">{kind}</text>')
    print(f'<text x="{(left + width - right) / 2:.0f}" y="{height - 10}" text-anchor="middle">prepare and shade, geometric mean over the scenes</text>')
    print(f'<text transform="translate(16 {(top + height - bottom) / 2:.0f}) rotate(-90)" text-anchor="middle">mean absolute error over shadow pixels</text>')
    print("</svg>")


if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[2] not in ("ratios", "scenes", "settings", "plot"):
        sys.exit(__doc__)
    {"ratios": ratios, "scenes": scenes, "settings": settings, "plot": plot}[sys.argv[2]](rows_of(sys.argv[1]))
