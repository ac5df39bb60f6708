"""A prior graph as a table in the terminal."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

from sgm.messages import shorten
from sgm.prior.prior_graph import Placement, PriorGraph


def select_rows(
    prior: PriorGraph, *, room: str | None = None, label: str | None = None
) -> tuple[Placement, ...]:
    """Placements of one room, one object type, or both.

    Raises:
        ValueError: if the prior has no such room or object; lists what it has.
    """
    if room is not None and room not in prior.rooms:
        raise ValueError(
            f"room must be one of {', '.join(prior.rooms)}, got {shorten(room)}. Choose one."
        )
    labels = [row.label for row in prior.objects]
    if label is not None and label not in labels:
        close = [other for other in labels if label[:3] in other] or labels
        raise ValueError(
            f"object must be in the prior, got {shorten(label)}. Choose one of {', '.join(close)}."
        )
    return tuple(
        row
        for row in prior.placements
        if (room is None or row.room in (room, None)) and (label is None or row.object == label)
    )


def print_prior(
    prior: PriorGraph,
    placements: Sequence[Placement],
    *,
    room: str | None = None,
    label: str | None = None,
    top: int = 6,
) -> None:
    """Print a prior as a table.

    With an object: its places, the likeliest first, with count and source. Without: the furniture
    of the rooms, and on each piece the `top` objects that are most typical of it. The rows are
    those that `select_rows` chose for the room and the object.

    Raises:
        ModuleNotFoundError: if `rich` is not installed.
    """
    try:
        from rich.console import Console
        from rich.table import Table
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            "showing a prior must find the package 'rich', got none. "
            "Install it with `pip install rich matplotlib`."
        ) from error
    table = Table(title="places" if label else "furniture", title_justify="left")
    if label:
        for column in ("room", "furniture", "relation", "prob", "count", "source"):
            table.add_column(column, justify="right" if column in ("prob", "count") else "left")
        for row in sorted(placements, key=lambda row: -row.prob):
            count = "" if row.count is None else f"{row.count:g}"
            cells = (row.room or "(any)", row.furniture, row.relation, f"{row.prob:.4f}", count)
            table.add_row(*cells, row.source or "")
    else:
        for column in ("room", "furniture", "prob", "objects", "most typical objects"):
            table.add_column(column, justify="right" if column in ("prob", "objects") else "left")
        on_furniture: dict[tuple[str | None, str], list[Placement]] = defaultdict(list)
        for row in placements:
            on_furniture[row.room, row.furniture].append(row)
        for node in prior.furniture:
            if room is not None and node.room != room:
                continue
            rows = on_furniture[node.room, node.label] + on_furniture[None, node.label]
            typical = sorted(rows, key=lambda row: -row.prob)[:top]
            names = ", ".join(f"{row.object} {row.prob:.2f}" for row in typical)
            number = str(len({row.object for row in rows}))
            table.add_row(node.room, node.label, f"{node.prob:.3f}", number, names)
    Console().print(table)


def summarise_prior(prior: PriorGraph) -> str:
    """Sizes of a prior, in one line."""
    pairs = {(row.room, row.object) for row in prior.placements}
    places = {(row.room, row.object, row.furniture) for row in prior.placements}
    return (
        f"{len(prior.rooms)} rooms, {len(prior.furniture)} furniture nodes, "
        f"{len(prior.objects)} objects, {len(prior.placements)} placements, "
        f"{len(places) / len(pairs):.1f} furniture types per (room, object), "
        f"checksum {prior.checksum[:12]}"
    )
