"""Measures the growth curves and draws them: `python benchmarks/growth`.

Writes `growth.csv` and `growth.png` into `--out`, and prints one JSON line whose figure is the
steepest slope at the large end of a curve of time: 1 is linear. `--only life` measures one part
again, and keeps the other curves of the table.
"""

from __future__ import annotations

import argparse
import csv
import json
from collections import defaultdict
from pathlib import Path

import numpy as np
from building import measure_building
from curves import (
    Point,
    measure_home,
    measure_homes,
    measure_memory,
    measure_objects,
    measure_reading,
)
from life import measure_life
from matplotlib.figure import Figure

PARTS = ("objects", "homes", "memory", "home", "reading", "life", "building")
FOLDER = Path(__file__).resolve().parent


def compute_slope(points: list[Point]) -> float:
    """Return the slope of the last third of a curve in log-log axes."""
    last = points[-max(len(points) // 3, 1) - 1 :]
    size, cost = np.log([point.size for point in last]), np.log([point.cost for point in last])
    return float(np.polyfit(size, cost, 1)[0])


def draw(curves: dict[str, list[Point]]) -> Figure:
    """Draw all curves, each with a line of slope 1 through its last point."""
    rows = -(-len(curves) // 3)
    figure = Figure(figsize=(13, 3.2 * rows), layout="constrained")
    axes = figure.subplots(rows, 3, squeeze=False).ravel()
    for axis, (name, points) in zip(axes, curves.items(), strict=False):
        measured, size_of = name.split(", by ")
        size = np.array([point.size for point in points], dtype=float)
        cost = np.array([point.cost for point in points])
        axis.loglog(size, cost, "o-", label="measured")
        axis.loglog(size, cost[-1] * size / size[-1], ":", color="grey", label="linear")
        axis.set_title(measured, fontsize=11)
        axis.set_xlabel(size_of)
        axis.set_ylabel(measured.partition(" in ")[2] or "seconds")
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8)
    for axis in axes[len(curves) :]:
        axis.set_axis_off()
    return figure


def read_curves(path: Path) -> dict[str, list[Point]]:
    """Return the curves of an earlier measurement."""
    found = defaultdict(list)
    with path.open(newline="", encoding="utf-8") as file:
        for line in csv.DictReader(file):
            found[line["curve"]].append(
                Point(line["curve"], int(line["size"]), float(line["cost"]))
            )
    return found


def main() -> None:
    """Measure, write, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tiny", action="store_true", help="small sizes: for the tests")
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder of the CSV and the figure")
    parser.add_argument("--only", choices=PARTS, help="measure a part; keep the other curves")
    options = parser.parse_args()
    largest, repeats = (1_000, 1) if options.tiny else (1_000_000, 5)
    decades = [10**power for power in range(7) if 10**power <= largest]
    objects = [200, *(size for size in decades if 1_000 <= size <= 100_000)]
    # 300,000 as well: from there on, pages are given back
    snapshots = [100, 1_000] if options.tiny else [100, 1_000, 10_000, 100_000, 300_000, 1_000_000]
    lives = [100, 300] if options.tiny else [100, 300, 1_000, 3_000, 10_000, 30_000, 100_000]
    places = [(10, 50), (50, 500), (200, 2_000), (500, 5_000), (2_000, 20_000)]
    things = [(100, 50), (100, 500), (100, 5_000), (100, 20_000)]
    if options.tiny:
        places, things = [(5, 20), (10, 50)], [(10, 50), (10, 100)]
    table = options.out / "growth.csv"
    found = read_curves(table) if options.only else defaultdict(list)
    for part, points in {
        "objects": measure_objects(objects, repeats),
        "homes": measure_homes(
            [size for size in decades if size <= min(largest // 10, 10_000)], repeats
        ),
        "memory": measure_memory(objects, 10 * repeats),
        "home": measure_home(objects, min(repeats, 3)),
        "reading": measure_reading(snapshots, 20 * repeats),
        "life": measure_life(lives, 10 * repeats),
        "building": measure_building(places, things),
    }.items():
        if options.only in (None, part):
            fresh = defaultdict(list)
            for point in points:
                fresh[point.curve].append(point)
            found |= fresh
    options.out.mkdir(parents=True, exist_ok=True)
    with table.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["curve", "size", "cost"])
        for points in found.values():
            writer.writerows((p.curve, p.size, f"{p.cost:.4g}") for p in points)
    draw(found).savefig(options.out / "growth.png", dpi=80, metadata={"Software": None})
    slopes = {name: round(compute_slope(points), 2) for name, points in found.items()}
    line = {"benchmark": "growth", "figure": max(slopes.values()), "unit": "slope", **slopes}
    print(json.dumps(line))


if __name__ == "__main__":
    main()
