"""Pictures of a grid home: rooms, furniture coloured by belief, objects, agent and its path.

Colours and shades are those of `simulator.drawing`, and `make_plan` gives its functions the grid
as a floor plan. The frames of a search are drawn here, cell by cell: walls, doors, the agent and
its way have no counterpart there, and matplotlib takes 112 ms of a core for the furniture alone,
where all of a frame takes 13 here: too long for a window of ten frames a second.
"""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from simulator.drawing import home as drawn
from simulator.igridson.layout import GridLayout
from simulator.igridson.navigation import DIRECTIONS
from simulator.igridson.scene import NEUTRALS, Color, GridScene, GridThing


def _read_color(text: str) -> Color:
    red, green, blue = bytes.fromhex(text.removeprefix("#"))
    return red, green, blue


WALL: Color = (63, 68, 80)
WALL_TEXT: Color = (236, 238, 242)
FLOORS: tuple[Color, ...] = ((244, 239, 230), (233, 240, 236), (238, 236, 245), (229, 239, 246))
DOOR: Color = (201, 173, 133)
FURNITURE: Color = (255, 253, 248)
OUTLINE: Color = (120, 124, 134)
BELIEF: Color = _read_color(drawn.BELIEF)
AGENT: Color = _read_color(drawn.ROUTE)
FOUND: Color = (22, 150, 84)
TEXT: Color = (28, 30, 36)
PAPER: Color = (255, 255, 255)
ASKED: Color = _read_color(drawn.TRUE_PLACE)

# Lengths in cells.
LABEL_SIZE, ROOM_SIZE, TITLE_SIZE, NOTE_SIZE = 0.27, 0.42, 0.5, 0.38  # text heights
LABEL_TOP = 0.14  # from the upper edge of the cell to a label
LINE = 0.245  # from one line of a label to the next
MARGIN = 0.04  # between furniture and the edge of its cells
GLYPH = 0.105  # radius of an object
STAR = 0.2
CAPTION = 1.9  # height of the strip below the home
SPOTS_ACROSS = 3  # objects side by side in a cell
PITCH = 0.24  # from one row of them to the next

LEGEND = {
    "asked": "asked for",
    "on top": "object on top",
    "inside": "object inside",
    "looked": "looked at",
    "found": "found",
}

_SMOOTH = 2  # everything is drawn so many times larger, then shrunk


class HomePicture:
    """Draws scenes of one layout.

    Labels of furniture stand in the upper part of its first row of cells, objects below; names
    of rooms stand in the wall above them. So nothing covers anything. All drawing takes lengths
    in cells; the caption is a strip of `CAPTION` cells below the home.

    Attributes:
        tile: pixels per cell.
    """

    def __init__(self, layout: GridLayout, tile: int = 40) -> None:
        """Draw what never changes.

        Raises:
            ValueError: if the cells are too small for labels, or too large for a picture.
        """
        if not 32 <= tile <= 320:
            raise ValueError(f"tile must lie in 32 to 320 pixels, got {tile}. Take 40.")
        self.layout = layout
        self.tile = tile
        self._scale = tile * _SMOOTH
        self._fonts = {
            size: ImageFont.load_default(size=round(size * self._scale))
            for size in (LABEL_SIZE, ROOM_SIZE, TITLE_SIZE, NOTE_SIZE)
        }
        self._labels = [self._wrap(piece.label, piece.width) for piece in layout.furniture]
        self._ground = self._draw_ground()

    def draw(self, scene: GridScene) -> np.ndarray:
        """Draw a scene, uint8 (height, width, 3)."""
        image = self._ground.copy()
        pen = ImageDraw.Draw(image)
        self._draw_furniture(pen, scene)
        self._draw_trail(pen, scene)
        self._draw_things(pen, scene)
        self._draw_agent(pen, scene)
        self._draw_caption(pen, scene)
        return np.asarray(image.reduce(_SMOOTH))

    def _draw_ground(self) -> Image.Image:
        """Draw walls, floors, doors, names of rooms and the legend."""
        layout = self.layout
        columns, rows = layout.size
        size = columns * self._scale, round((rows + CAPTION) * self.tile) * _SMOOTH
        image = Image.new("RGB", size, PAPER)
        pen = ImageDraw.Draw(image)
        pen.rectangle(self._box(0, 0, columns, rows), fill=WALL)
        for y, x in np.argwhere(layout.room >= 0):
            pen.rectangle(self._box(x, y, 1, 1), fill=FLOORS[layout.room[y, x] % len(FLOORS)])
        for y, x in np.argwhere(layout.is_door):
            pen.rectangle(self._box(x, y, 1, 1), fill=DOOR)
        for index, name in enumerate(layout.rooms):
            cells = np.argwhere(layout.room == index)
            (top, left), (_, right) = cells.min(axis=0), cells.max(axis=0)
            x = self._shift_off_doors((left + right + 1) / 2, top - 1, name)
            self._write(pen, x, top - 0.5, name, ROOM_SIZE, WALL_TEXT)
        self._draw_legend(pen)
        return image

    def _draw_furniture(self, pen: ImageDraw.ImageDraw, scene: GridScene) -> None:
        for index, (piece, lines) in enumerate(
            zip(self.layout.furniture, self._labels, strict=True)
        ):
            fill, edge, width = FURNITURE, OUTLINE, 1.0
            if scene.belief is not None:
                fill = mix(FURNITURE, BELIEF, float(drawn.compute_shade(scene.belief[index])))
            if index in scene.looked_at:
                is_last = index == scene.looked_at[-1]
                edge, width = (FOUND if scene.is_found and is_last else AGENT), 2.5
            left, top, across, down = piece.column, piece.row, piece.width, piece.height
            box = self._box(left + MARGIN, top + MARGIN, across - 2 * MARGIN, down - 2 * MARGIN)
            pen.rounded_rectangle(box, 0.12 * self._scale, fill, edge, round(width * _SMOOTH))
            for turn, line in enumerate(lines):
                y = top + LABEL_TOP + LINE * (turn + 0.5)
                self._write(pen, left + across / 2, y, line, LABEL_SIZE)

    def _draw_trail(self, pen: ImageDraw.ImageDraw, scene: GridScene) -> None:
        pale = mix(AGENT, PAPER, 0.45)
        points = [((x + 0.5) * self._scale, (y + 0.5) * self._scale) for x, y in scene.trail]
        if len(points) > 1:
            pen.line(points, fill=pale, width=round(0.09 * self._scale), joint="curve")
        for x, y in scene.trail[:1]:
            self._draw_disc(pen, x + 0.5, y + 0.5, 0.12, fill=pale)

    def _draw_things(self, pen: ImageDraw.ImageDraw, scene: GridScene) -> None:
        """Draw the objects cell by cell; where they do not fit, write how many more there are."""
        by_cell: dict[tuple[int, int], list[GridThing]] = {}
        for thing in scene.things:
            by_cell.setdefault(thing.cell, []).append(thing)
        stars = []
        for (x, y), things in by_cell.items():
            things.sort(key=lambda thing: not thing.is_asked)  # what is asked for always fits
            spots = self._list_spots(x, y, len(things))
            if len(things) > len(spots):
                more = f"+{len(things) - len(spots) + 1}"
                self._write(pen, *spots.pop(), more, LABEL_SIZE)
            for thing, spot in zip(things, spots, strict=False):
                if thing.is_asked:
                    stars.append(spot)
                else:
                    self._draw_thing(pen, *spot, thing)
        for spot in stars:
            self._draw_star(pen, *spot)

    def _list_spots(self, x: int, y: int, count: int) -> list[tuple[float, float]]:
        """List where the objects of a cell are drawn; at most `count` places, row after row."""
        furniture = int(self.layout.furniture_at[y, x])
        top = 0.1
        if y == self.layout.furniture[furniture].row:
            top = LABEL_TOP + len(self._labels[furniture]) * LINE + 0.02
        num_rows = min(max(int((0.9 - top) / PITCH), 1), -(-count // SPOTS_ACROSS))
        middle = (top + 0.9) / 2
        spots = []
        for row in range(num_rows):
            across = min(count - row * SPOTS_ACROSS, SPOTS_ACROSS)
            at_y = y + middle + (row - (num_rows - 1) / 2) * PITCH
            spots += [(x + 0.5 + (n - (across - 1) / 2) * 0.27, at_y) for n in range(across)]
        return spots

    def _draw_thing(self, pen: ImageDraw.ImageDraw, x: float, y: float, thing: GridThing) -> None:
        fill, shade, width = (PAPER, 0.25, 2) if thing.is_inside else (thing.color, 0.5, 1)
        edge = mix(thing.color, TEXT, shade)
        self._draw_disc(pen, x, y, GLYPH, fill=fill, outline=edge, width=width)

    def _draw_agent(self, pen: ImageDraw.ImageDraw, scene: GridScene) -> None:
        x, y = scene.position[0] + 0.5, scene.position[1] + 0.5
        self._draw_disc(pen, x, y, 0.36, fill=AGENT, outline=PAPER, width=2)
        ahead = DIRECTIONS[scene.direction]
        arrow = [(0.26, 0.0), (-0.13, 0.19), (-0.05, 0.0), (-0.13, -0.19)]  # ahead, aside
        corners = np.array([x, y]) + np.array(arrow) @ np.array([ahead, (-ahead[1], ahead[0])])
        pen.polygon((corners * self._scale).ravel().tolist(), fill=PAPER)

    def _draw_caption(self, pen: ImageDraw.ImageDraw, scene: GridScene) -> None:
        columns, rows = self.layout.size
        self._write(pen, 0.3, rows + 0.55, scene.title, TITLE_SIZE, anchor="lm")
        self._write(pen, columns - 0.3, rows + 0.55, scene.note, NOTE_SIZE, anchor="rm")
        if scene.belief is None:
            return
        x, y, width = columns - 4.6, rows + CAPTION - 0.5, 2.4
        for step in range(48):
            color = mix(FURNITURE, BELIEF, float(drawn.compute_shade(step / 47)))
            left = x + step / 48 * width
            pen.rectangle(self._box(left, y - 0.15, width / 48 + 0.03, 0.3), fill=color)
        pen.rectangle(self._box(x, y - 0.15, width + 0.03, 0.3), outline=OUTLINE, width=_SMOOTH)
        self._write(pen, x - 0.2, y, "belief 0", NOTE_SIZE, anchor="rm")
        self._write(pen, x + width + 0.2, y, "100 %", NOTE_SIZE, anchor="lm")

    def _draw_legend(self, pen: ImageDraw.ImageDraw) -> None:
        x, y = 0.5, self.layout.size[1] + CAPTION - 0.5
        for mark, text in LEGEND.items():
            if mark == "asked":
                self._draw_star(pen, x, y)
            elif mark in ("looked", "found"):
                color = FOUND if mark == "found" else AGENT
                box, radius = self._box(x - 0.16, y - 0.16, 0.32, 0.32), 0.05 * self._scale
                pen.rounded_rectangle(box, radius, FURNITURE, color, width=3 * _SMOOTH)
            else:
                self._draw_thing(pen, x, y, GridThing((0, 0), mark == "inside", NEUTRALS[0], False))
            self._write(pen, x + 0.34, y, text, NOTE_SIZE, anchor="lm")
            x += 0.95 + self._measure(text, NOTE_SIZE)

    def _draw_disc(
        self,
        pen: ImageDraw.ImageDraw,
        x: float,
        y: float,
        radius: float,
        fill: Color,
        outline: Color | None = None,
        width: int = 1,
    ) -> None:
        box = [c * self._scale for c in (x - radius, y - radius, x + radius, y + radius)]
        pen.ellipse(box, fill=fill, outline=outline, width=width * _SMOOTH)

    def _draw_star(self, pen: ImageDraw.ImageDraw, x: float, y: float) -> None:
        angles = np.arange(10) * np.pi / 5 - np.pi / 2
        lengths = np.where(np.arange(10) % 2 == 0, STAR, 0.45 * STAR)
        across, down = x + lengths * np.cos(angles), y + lengths * np.sin(angles)
        corners = np.stack([across, down], axis=1) * self._scale
        pen.polygon(corners.ravel().tolist(), fill=ASKED, outline=PAPER, width=_SMOOTH)

    def _write(
        self,
        pen: ImageDraw.ImageDraw,
        x: float,
        y: float,
        text: str,
        size: float,
        color: Color = TEXT,
        anchor: str = "mm",
    ) -> None:
        position = (x * self._scale, y * self._scale)
        pen.text(position, text, fill=color, font=self._fonts[size], anchor=anchor)

    def _measure(self, text: str, size: float) -> float:
        """Return the width of a text in cells."""
        return self._fonts[size].getlength(text) / self._scale

    def _wrap(self, label: str, width: int) -> list[str]:
        """Break a label into lines that fit furniture so many cells wide."""
        lines: list[str] = []
        for word in label.split():
            if lines and self._measure(f"{lines[-1]} {word}", LABEL_SIZE) <= width - 0.16:
                lines[-1] = f"{lines[-1]} {word}"
            else:
                lines.append(word)
        return lines

    def _shift_off_doors(self, x: float, row: int, name: str) -> float:
        """Move a name that is centred at x along its wall until it covers no door."""
        half = self._measure(name, ROOM_SIZE) / 2 + 0.2
        doors = np.flatnonzero(self.layout.is_door[row])
        for shift in sorted(np.arange(-8, 8.5, 0.5), key=abs):
            if not ((doors < x + shift + half) & (doors + 1 > x + shift - half)).any():
                return float(x + shift)
        return float(x)

    def _box(self, column: float, row: float, width: float, height: float) -> list[float]:
        """Return the pixel box of a rectangle of cells, both ends inclusive."""
        scale = self._scale
        return [
            column * scale,
            row * scale,
            (column + width) * scale - 1,
            (row + height) * scale - 1,
        ]


def mix(color: Color, other: Color, share: float) -> Color:
    """Return a colour on the way from one to another."""
    red, green, blue = (round(a + (b - a) * share) for a, b in zip(color, other, strict=True))
    return red, green, blue
