"""Draws the folders of the packages: a column for each package, what imports others above them.

From the root of a checkout: `python -m docs.draw_layers`.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.axes import Axes

from tests.imports import find_part, list_module_imports

PICTURE = Path(__file__).parent / "images" / "layers.png"
# Columns from the left: each imports those left of it. A column may hold two packages.
COLUMNS = (("sgm",), ("simulator",), ("datamodules", "nep", "tools"))
COLOURS = {
    "sgm": "#f6dcdc",
    "simulator": "#dcebdc",
    "datamodules": "#dfe6f5",
    "nep": "#f7e3cd",
    "tools": "#e8e8e8",
}
_BESIDE = 3  # boxes in a line of a column


def list_arrows() -> dict[str, set[str]]:
    """Return the parts that each part imports."""
    arrows: dict[str, set[str]] = {}
    for module, imports in list_module_imports().items():
        part = find_part(module)
        arrows.setdefault(part, set()).update({find_part(name) for name in imports} - {part})
    # These hand names on to users: nothing stands above them.
    for package in ("sgm", "simulator", "nep", "tools"):
        del arrows[package]
    return {part: targets & arrows.keys() for part, targets in arrows.items()}


def compute_floors(arrows: dict[str, set[str]]) -> dict[str, int]:
    """Put every part one floor above the highest that it imports."""
    floors: dict[str, int] = {}

    def climb(part: str) -> int:
        if part not in floors:
            floors[part] = 0  # ends a circle, of which tests/test_layers.py allows none
            floors[part] = max((climb(target) + 1 for target in arrows[part]), default=0)
        return floors[part]

    for part in arrows:
        climb(part)
    return floors


def list_lines(arrows: dict[str, set[str]], packages: tuple[str, ...]) -> list[list[str]]:
    """Return the lines of a column from the bottom; a part imports none of its own line."""
    own = {part for part in arrows if part.partition(".")[0] in packages}
    floors = compute_floors({part: arrows[part] & own for part in own})
    lines = []
    for floor in range(max(floors.values()) + 1):
        parts = sorted(part for part in own if floors[part] == floor)
        lines += [parts[start : start + _BESIDE] for start in range(0, len(parts), _BESIDE)]
    return lines


def draw_column(axes: Axes, left: int, packages: tuple[str, ...], lines: list[list[str]]) -> None:
    """Draw the boxes of a column above its title."""
    axes.text(left + 0.5, -1.1, ", ".join(packages), ha="center", va="center", weight="bold")
    for height, parts in enumerate(lines):
        for number, part in enumerate(parts):
            package, _, name = part.partition(".")
            text = {"__main__": "commands", "": package}.get(name, name.replace("_", " "))
            box = {"boxstyle": "round,pad=0.3", "ec": "#707070", "lw": 0.7, "fc": COLOURS[package]}
            x = left + 0.03 + 0.94 * (number + 0.5) / len(parts)
            axes.text(x, height, text, ha="center", va="center", fontsize=8, bbox=box)


def main() -> None:
    """Write docs/images/layers.png; its metadata names the parts that it shows."""
    arrows = list_arrows()
    columns = [list_lines(arrows, packages) for packages in COLUMNS]
    top = max(map(len, columns))
    figure, axes = plt.subplots(figsize=(9.5, 0.42 * top + 0.9), layout="constrained")
    for left, (packages, lines) in enumerate(zip(COLUMNS, columns, strict=True)):
        draw_column(axes, left, packages, lines)
        if left:
            axes.axvline(left, color="#c0c0c0", linewidth=0.8)
            arrow = {"arrowstyle": "->", "color": "#505050", "lw": 1.5}
            axes.annotate("", (left - 0.12, -1.1), (left + 0.12, -1.1), arrowprops=arrow)
    axes.set(xlim=(0, len(COLUMNS)), ylim=(-1.7, top - 0.4))
    axes.axis("off")
    figure.savefig(
        PICTURE, dpi=110, metadata={"Software": None, "Description": " ".join(sorted(arrows))}
    )


if __name__ == "__main__":
    main()
