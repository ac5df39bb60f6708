"""Reads a home on a grid from a text file.

The file has a first line `iGridson layout 1` and four sections, each begun by its name on a line
of its own; blank lines and what follows a `;` are skipped:

    rooms      a letter and a name per line: the letter stands for the room's floor in the map
    map        `#` wall, `+` door, a room's letter for its floor; all lines equally long
    furniture  `column row  width x height  label` per line, for example `1 1  1x2  fridge`
    start      `column row` of the cell where the agent stands at first

Columns and rows are counted from 0 at the top left. A furniture node belongs to the room that
its cells lie in.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sgm.files import open_file
from sgm.messages import shorten
from simulator.igridson.layout import GridFurniture, GridLayout, check_layout

VERSION_LINE = "iGridson layout 1"
SECTIONS = ("rooms", "map", "furniture", "start")
MAX_CELLS = 1_000_000  # of a map: a kilometre by a kilometre
_MAX_BYTES = 8 * MAX_CELLS  # of a file
DEFAULT_LAYOUT = Path(__file__).parent / "data" / "home.txt"


def load_layout(path: str | Path | None = None) -> GridLayout:
    """Load a layout file; None for the shipped home of four rooms and 21 furniture nodes.

    Raises:
        OSError: if the file cannot be read.
        ValueError: if it is broken or too large; the message names the line or the cell.
    """
    path = DEFAULT_LAYOUT if path is None else Path(path)
    with open_file(path) as file:
        content = file.read(_MAX_BYTES + 1)
    if len(content) > _MAX_BYTES:
        raise ValueError(
            f"layout must be a file of at most {_MAX_BYTES} bytes, got more in {path}. "
            "Check the path, or draw a smaller home."
        )
    try:
        return parse_layout(content.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise ValueError(
            f"layout must be UTF-8, got {error} in {path}. Save it as UTF-8, or check the path."
        ) from None


def parse_layout(text: str) -> GridLayout:
    """Build a layout from the text of a layout file and check it.

    Raises:
        ValueError: if it is broken; the message names the line or the cell.
    """
    sections = _split_sections(text)
    rooms = [_parse_room(number, line) for number, line in sections["rooms"]]
    letters = [letter for letter, _ in rooms]
    grid = _parse_map(sections["map"], letters)
    pieces = [_parse_furniture(number, line) for number, line in sections["furniture"]]
    if len(sections["start"]) != 1:
        raise ValueError(
            f"start must be one line 'column row', got {len(sections['start'])} lines. "
            "Name one free cell."
        )
    start = _parse_numbers(*sections["start"][0], noun="start", rule="be 'column row'")
    room = np.full(grid.shape, -1)
    for index, letter in enumerate(letters):
        room[grid == letter] = index
    names = tuple(name for _, name in rooms)
    _check_pieces(pieces, grid == "#", room, names)
    pieces.sort(key=lambda piece: room[piece.row, piece.column])
    furniture_at = np.full(grid.shape, -1)
    for index, piece in enumerate(pieces):
        for x, y in piece.cells:
            furniture_at[y, x] = index
    layout = GridLayout(
        rooms=names,
        is_wall=grid == "#",
        is_door=grid == "+",
        room=room,
        furniture=tuple(pieces),
        furniture_room=np.array(
            [room[piece.row, piece.column] for piece in pieces], dtype=np.int64
        ),
        furniture_at=furniture_at,
        start=start,
    )
    check_layout(layout)
    return layout


def _check_pieces(
    pieces: list[GridFurniture], is_wall: np.ndarray, room: np.ndarray, rooms: tuple[str, ...]
) -> None:
    """Check that each piece of furniture has its cells on the floor of one room to itself."""
    num_rows, num_columns = room.shape
    owner: dict[tuple[int, int], GridFurniture] = {}
    for piece in pieces:
        noun = f"furniture '{piece.label}'"
        # Before its cells are listed, of which there may be billions.
        is_wide = piece.column + piece.width > num_columns
        if is_wide or piece.row + piece.height > num_rows:
            x, y = (
                (max(piece.column, num_columns), piece.row) if is_wide else (piece.column, num_rows)
            )
            raise ValueError(
                f"{noun} must lie inside the map of {num_columns} x {num_rows} cells, got "
                f"column {x}, row {y}. Move it or make it smaller."
            )
        for x, y in piece.cells:
            if room[y, x] < 0:
                ground = "a wall" if is_wall[y, x] else "a door"
                raise ValueError(
                    f"{noun} must stand on floor, got {ground} at column {x}, row {y}. "
                    "Move it or make it smaller."
                )
            if (x, y) in owner:
                raise ValueError(
                    f"{noun} must have its cells to itself, got '{owner[x, y].label}' at column "
                    f"{x}, row {y}, too. Move one of them."
                )
            if room[y, x] != room[piece.row, piece.column]:
                raise ValueError(
                    f"{noun} must stand in one room, got {rooms[room[piece.row, piece.column]]} "
                    f"and, at column {x}, row {y}, {rooms[room[y, x]]}. Move it."
                )
            owner[x, y] = piece


def _split_sections(text: str) -> dict[str, list[tuple[int, str]]]:
    """Return the (line number, content) pairs of each section."""
    lines = [line.partition(";")[0].rstrip() for line in text.splitlines()]
    if not lines or lines[0] != VERSION_LINE:
        raise ValueError(
            f"layout must begin with the line '{VERSION_LINE}', got {shorten((lines or [''])[0])}. "
            "Add the line, or give another file."
        )
    sections: dict[str, list[tuple[int, str]]] = {}
    current: list[tuple[int, str]] | None = None
    for number, line in enumerate(lines[1:], start=2):
        if line in SECTIONS:
            current = sections.setdefault(line, [])
        elif line:
            if current is None:
                raise ValueError(
                    f"line must belong to a section ({', '.join(SECTIONS)}), got {shorten(line)} "
                    f"in line {number}. Begin a section first."
                )
            current.append((number, line))
    for name in SECTIONS:
        if not sections.get(name):
            raise ValueError(f"layout must have a section '{name}' with content, got none. Add it.")
    return sections


def _parse_room(number: int, line: str) -> tuple[str, str]:
    """Read 'k kitchen'."""
    letter, _, name = line.strip().partition(" ")
    if len(letter) != 1 or letter in "#+" or not name.strip():
        raise ValueError(
            f"room must be a letter and a name, got {shorten(line)} in line {number}. Write for "
            "example 'k kitchen'."
        )
    return letter, name.strip()


def _parse_map(lines: list[tuple[int, str]], letters: list[str]) -> np.ndarray:
    """Read the map as single characters, (Y, X)."""
    width = len(lines[0][1])
    if width * len(lines) > MAX_CELLS:
        raise ValueError(
            f"map must have at most {MAX_CELLS} cells, got {width} x {len(lines)}. Draw a smaller "
            "home."
        )
    for row, (number, line) in enumerate(lines):
        if len(line) != width:
            raise ValueError(
                f"map must have equally long lines, got {len(line)} cells instead of {width} in "
                f"row {row} (line {number}). Fill it with '#'."
            )
        for column, letter in enumerate(line):
            if letter not in ("#", "+", *letters):
                raise ValueError(
                    f"cell must be '#', '+' or a room's letter ({', '.join(letters)}), got "
                    f"{shorten(letter)} at column {column}, row {row} (line {number}). Name the "
                    "room in the section 'rooms'."
                )
    return np.array([list(line) for _, line in lines])


def _parse_furniture(number: int, line: str) -> GridFurniture:
    """Read '1 1  1x2  fridge'."""
    rule = "be 'column row  width x height  label'"
    words = line.replace(" x ", "x").split()
    column, row = _parse_numbers(number, " ".join(words[:2]), "furniture", rule)
    size = " ".join(words[2:3]).replace("x", " ")
    width, height = _parse_numbers(number, size, "furniture", rule)
    label = " ".join(words[3:])
    if not label or width < 1 or height < 1:
        raise ValueError(
            f"furniture must {rule}, got {shorten(line)} in line {number}. Write for example '1 1  "
            "1x2  fridge'."
        )
    return GridFurniture(label, column, row, width, height)


def _parse_numbers(number: int, text: str, noun: str, rule: str) -> tuple[int, int]:
    """Read two non-negative integers."""
    words = text.split()
    if len(words) != 2 or not all(word.isdecimal() and len(word) < 10 for word in words):
        raise ValueError(
            f"{noun} must {rule}, got {shorten(text)} in line {number}. Write non-negative numbers "
            "of at most 9 digits."
        )
    return int(words[0]), int(words[1])
