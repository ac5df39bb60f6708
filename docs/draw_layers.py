"""Draws the folders of the packages, the ones that import others above them.

From the root of a checkout: `python -m docs.draw_layers`.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt

from tests.imports import PACKAGES, find_part, list_module_imports

PICTURE = Path(__file__).parent / "images" / "layers.png"
COLOURS = dict(zip(PACKAGES, ("#f6dcdc", "#dcebdc", "#dfe6f5", "#f7e3cd", "#e8e8e8"), strict=True))
_FIT = 8  # boxes side by side; of more, every second one is lifted


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


def drop_implied(arrows: dict[str, set[str]]) -> dict[str, set[str]]:
    """Leave out what a part imports of a part that lies below another that it imports."""
    below: dict[str, set[str]] = {}
    for part in sorted(arrows, key=compute_floors(arrows).__getitem__):
        below[part] = arrows[part].union(*(below[target] for target in arrows[part]))
    return {
        part: {target for target in targets if all(target not in below[other] for other in targets)}
        for part, targets in arrows.items()
    }


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


def main() -> None:
    """Write docs/images/layers.png; its metadata names the parts that it shows."""
    arrows = list_arrows()
    floors = compute_floors(arrows)
    top = max(floors.values())
    at: dict[str, tuple[float, float]] = {}
    for floor in range(top + 1):
        parts = sorted(part for part in floors if floors[part] == floor)
        for number, part in enumerate(parts):
            lift = 0.45 * (number % 2) if len(parts) > _FIT else 0
            at[part] = ((number + 0.5) / len(parts), floor + lift)
    figure, ax = plt.subplots(figsize=(11, 0.62 * (top + 1)), layout="constrained")
    for part, targets in drop_implied(arrows).items():
        for target in targets:
            (x, y), (to_x, to_y) = at[part], at[target]
            ax.plot([x, to_x], [y - 0.2, to_y + 0.2], color="#b8b8b8", lw=0.6, zorder=1)
    for part, (x, y) in at.items():
        style = {"boxstyle": "round,pad=0.35", "ec": "#707070", "lw": 0.7}
        text = part.replace(".__main__", " commands").replace(".", "/")
        colour = COLOURS[part.partition(".")[0]]
        ax.text(x, y, text, ha="center", va="center", fontsize=8, bbox=style | {"fc": colour})
    ax.set(xlim=(-0.05, 1.05), ylim=(-0.6, top + 0.6))
    ax.axis("off")
    figure.savefig(
        PICTURE, dpi=110, metadata={"Software": None, "Description": " ".join(sorted(arrows))}
    )


if __name__ == "__main__":
    main()
