#!/usr/bin/env python3
"""The table of docs/accuracy-and-cost.md about error estimates, from the rows of `penumbra_bench estimates`.

    bench/estimate_table.py out/bench/estimates.csv
"""
import csv
import statistics
import sys
from collections import defaultdict


def kind_of(row):
    if row["by"] == "rays":
        return "rays"
    return "maps of a third, " + row["settings"].replace("map=", "").replace(" given", " texels a side")


def spread(values):
    return f"{min(values):.2f} / {statistics.median(values):.2f} / {max(values):.2f}"


def main(path):
    with open(path, encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#") and (line.startswith("estimates,") or line.startswith("bench,scene,technique,settings,by"))))
    groups = defaultdict(list)
    for row in rows:
        groups[kind_of(row)].append(row)
    print("| by | masks | mean: estimate over error, least / middle / greatest | 99 %: the same | inside 0.5 to 3, mean | ms, middle |")
    print("| --- | --- | --- | --- | --- | --- |")
    for kind, group in groups.items():
        means = [float(row["ratio_mean"]) for row in group]
        print(f"| {kind} | {len(group)} | {spread(means)} | {spread([float(row['ratio_p99']) for row in group])} | {sum(0.5 <= m <= 3 for m in means)} | "
              f"{statistics.median(float(row['estimate_ms']) for row in group):.0f} |")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
