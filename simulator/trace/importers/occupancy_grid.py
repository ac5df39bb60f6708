"""Rooms of an occupancy grid, as map servers keep it: free floor, split at doorways."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sgm.arrays.read_numbers import read_numbers
from sgm.messages import needed_to, shorten
from simulator.yaml_text import load_yaml

_MOST_CELLS = 1 << 26
_UNKNOWN = 205  # shade that map savers give to what was never seen, whatever the threshold is
_MODES = ("trinary", "scale", "raw")  # what a shade says
_LEAST_AREA = 2.0  # square metres of a room


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyGrid:
    """Free and occupied cells of a floor.

    Attributes:
        is_free: bool (rows, columns), the first row at the lowest y.
        resolution: metres of a cell.
        origin: x, y of the corner of the first cell.
    """

    is_free: np.ndarray
    resolution: float
    origin: tuple[float, float]


def load_grid(path: Path) -> OccupancyGrid:
    """Read the `map.yaml` of a map server, and the image that it names, PGM or PNG.

    Raises:
        ValueError: if one of them cannot be read, or the map is turned.
    """
    about = load_yaml("map", path)
    if not isinstance(about, dict) or not {"image", "resolution", "origin"} <= about.keys():
        raise ValueError(
            f"map must have image, resolution and origin, got {shorten(about)} in {path}. Give the "
            "map.yaml of a map server."
        )
    x, y, yaw = read_numbers(f"origin in {path}", about["origin"], (3,)).tolist()
    resolution = float(read_numbers(f"resolution in {path}", about["resolution"], ()))
    if not 1e-3 <= resolution <= 1.0 or abs(yaw) > 1e-3:
        raise ValueError(
            "map must have cells of 0.001 to 1 m and a yaw of 0, got "
            f"{resolution:g} m and {yaw:g} in {path}. Turn the map first."
        )
    free = float(read_numbers(f"free_thresh in {path}", about.get("free_thresh", 0.196), ()))
    mode = about.get("mode", "trinary")
    if mode not in _MODES:
        raise ValueError(
            f"mode of a map must be one of {', '.join(_MODES)}, got {shorten(mode)} in {path}. "
            "Leave it out for trinary."
        )
    shade = _read_image(path.parent / str(about["image"] or ""), path)
    if mode == "raw":  # a shade is the occupancy in percent; more than 100 is unknown
        is_free = shade < 100 * free
    else:
        occupied = (shade if about.get("negate", 0) in (1, True) else 255 - shade) / 255
        is_free = (occupied < free) & (shade != _UNKNOWN)
    return OccupancyGrid(np.flipud(is_free), resolution, (x, y))


def find_rooms(grid: OccupancyGrid, door: float = 1.0) -> dict[str, list[list[float]]]:
    """Return the outline of each room by its name, "room 1" for the largest.

    Doorways are where free floor is narrower than `door` metres: what is left when the floor is
    eroded by half of that are the hearts of rooms. Every free cell belongs to the nearest of them.
    An outline is that of the rows of cells of a room, so that it may have steps.

    Raises:
        ValueError: if there is no room of 2 square metres.
    """
    from scipy.ndimage import distance_transform_edt, label  # only this needs it

    framed = np.pad(grid.is_free, 1)
    away = distance_transform_edt(framed)[1:-1, 1:-1] * grid.resolution
    hearts, num = label(away > door / 2)
    rooms = []
    if num:
        nearest = distance_transform_edt(hearts == 0, return_distances=False, return_indices=True)
        owner = np.where(grid.is_free, hearts[tuple(nearest)], 0)
        rooms = [owner == number for number in range(1, num + 1)]
    rooms = [room for room in rooms if room.sum() * grid.resolution**2 >= _LEAST_AREA]
    if not rooms:
        raise ValueError(
            f"map must have a room of {_LEAST_AREA:g} square metres, got none where the floor is "
            f"wider than {door:g} m. Give a smaller --door."
        )
    rooms.sort(key=lambda room: -int(room.sum()))
    return {f"room {number}": _trace(room, grid) for number, room in enumerate(rooms, 1)}


def _trace(room: np.ndarray, grid: OccupancyGrid, most: int = 30) -> list[list[float]]:
    """Return the corners of the region between the first and the last cell of bands of rows."""
    rows = np.flatnonzero(room.any(axis=1))
    bands = np.array_split(rows, min(most, len(rows)))
    left: list[list[float]] = []
    right: list[list[float]] = []
    for band in bands:
        columns = np.flatnonzero(room[band].mean(axis=0) >= 0.5)
        if not len(columns):
            continue
        ends = np.array([[columns[0], band[0]], [columns[-1] + 1, band[-1] + 1]])
        (x0, y0), (x1, y1) = (ends * grid.resolution + grid.origin).tolist()
        left += [[x0, y0], [x0, y1]]
        right += [[x1, y0], [x1, y1]]
    return _drop_straight([*right, *left[::-1]])


def _drop_straight(corners: list[list[float]]) -> list[list[float]]:
    """Return a polygon without the corners that lie on a side, and those that are there twice."""
    kept: list[list[float]] = []
    for number, (x, y) in enumerate(corners):
        before = kept[-1] if kept else corners[-1]
        after = corners[(number + 1) % len(corners)]
        cross = (x - before[0]) * (after[1] - y) - (y - before[1]) * (after[0] - x)
        if abs(cross) > 1e-9:
            kept.append([round(x, 3), round(y, 3)])
    return kept


def _read_image(path: Path, where: Path) -> np.ndarray:
    """Return the shades of an image of one channel, 0 to 255, (rows, columns)."""
    if not path.is_file():
        raise ValueError(
            f"image of a map must be a file that exists, got none at {path}, of {where}. Save it "
            "beside the map, or correct its name."
        )
    with needed_to("read the image of a map", install="pillow"):
        from PIL import Image
    try:
        with Image.open(path, formats=("PPM", "PNG")) as image:
            if image.width * image.height > _MOST_CELLS:
                raise ValueError(f"{image.width} x {image.height} pixels")
            return np.asarray(image.convert("L"), dtype=float)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise ValueError(
            f"image of a map must be PGM or PNG of at most {_MOST_CELLS} pixels, got "
            f"{shorten(str(error)[:100])} for {path}, of {where}. Check the path."
        ) from None
