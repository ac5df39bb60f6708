"""Draws the folders of the three packages, the ones that import others above them."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import matplotlib.pyplot as plt

ROOT = Path(__file__).resolve().parents[1]
COLOURS = {"simulator": "#dcebdc", "datamodules": "#dfe6f5", "nep": "#f7e3cd"}


def find_room(path: Path) -> str:
    """Return the folder that a file belongs to: package and folder, or package and file."""
    package, *rest = path.relative_to(ROOT).with_suffix("").parts
    if package == "datamodules" or rest == ["__init__"]:
        return package
    return f"{package} commands" if path.name == "__main__.py" else f"{package}/{rest[0]}"


def list_imports(path: Path) -> Iterator[Path]:
    """Yield the files of our own that a file imports, but for types alone."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            node.body = []
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            module = ROOT.joinpath(*node.module.split("."))
            for candidate in (module.with_suffix(".py"), module / "__init__.py"):
                if candidate.is_file() and candidate.relative_to(ROOT).parts[0] in COLOURS:
                    yield candidate


def list_arrows() -> dict[str, set[str]]:
    """Return the folders that each folder imports."""
    arrows: dict[str, set[str]] = {}
    for package in COLOURS:
        for path in (ROOT / package).rglob("*.py"):
            room = find_room(path)
            targets = {find_room(target) for target in list_imports(path)}
            arrows.setdefault(room, set()).update(targets - {room})
    for package in ("simulator", "nep"):  # hand names on to users: nothing stands above them
        del arrows[package]
    return {room: targets & arrows.keys() for room, targets in arrows.items()}


def drop_implied(arrows: dict[str, set[str]]) -> dict[str, set[str]]:
    """Leave out what a folder imports of a folder that lies below another that it imports."""
    below: dict[str, set[str]] = {}
    for room in sorted(arrows, key=compute_floors(arrows).__getitem__):
        below[room] = arrows[room].union(*(below[target] for target in arrows[room]))
    return {
        room: {target for target in targets if all(target not in below[other] for other in targets)}
        for room, targets in arrows.items()
    }


def compute_floors(arrows: dict[str, set[str]]) -> dict[str, int]:
    """Put every folder one floor above the highest that it imports."""
    floors: dict[str, int] = {}

    def climb(room: str) -> int:
        if room not in floors:
            floors[room] = 0  # ends a circle, of which tests/test_layers.py allows none
            floors[room] = max((climb(target) + 1 for target in arrows[room]), default=0)
        return floors[room]

    for room in arrows:
        climb(room)
    return floors


def main() -> None:
    """Write docs/images/layers.png."""
    arrows = list_arrows()
    floors = compute_floors(arrows)
    top = max(floors.values())
    at: dict[str, tuple[float, float]] = {}
    for floor in range(top + 1):
        rooms = sorted(room for room in floors if floors[room] == floor)
        for number, room in enumerate(rooms):
            at[room] = ((number + 0.5) / len(rooms), floor)
    figure, ax = plt.subplots(figsize=(9, 0.62 * (top + 1)), layout="constrained")
    for room, targets in drop_implied(arrows).items():
        for target in targets:
            (x, y), (to_x, to_y) = at[room], at[target]
            ax.plot([x, to_x], [y - 0.2, to_y + 0.2], color="#b8b8b8", lw=0.6, zorder=1)
    for room, (x, y) in at.items():
        package = room.split("/")[0].split(" ")[0]
        style = {"boxstyle": "round,pad=0.35", "fc": COLOURS[package], "ec": "#707070", "lw": 0.7}
        ax.text(x, y, room, ha="center", va="center", fontsize=8, bbox=style, zorder=2)
    ax.set(xlim=(-0.05, 1.05), ylim=(-0.6, top + 0.6))
    ax.axis("off")
    figure.savefig(ROOT / "docs" / "images" / "layers.png", dpi=110, metadata={"Software": None})


if __name__ == "__main__":
    main()
