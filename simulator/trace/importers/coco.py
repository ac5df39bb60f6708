"""Detections in the format of COCO, with poses of the camera, as looks.

Source: the format of COCO (images, categories, and annotations or results with bbox and score);
poses as in the TUM RGB-D benchmark, "timestamp tx ty tz qx qy qz qw" a line; the camera as
camera_calibration of ROS writes it.
"""

from __future__ import annotations

import io
from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from sgm.camera.detection import Detection
from sgm.camera.pinhole import Intrinsics, Pose
from sgm.checks import check_at_least, is_finite, is_number
from sgm.files import make_read_error, read_file, read_json
from sgm.finder.home_map import HomeMap
from sgm.layout.areas import Areas
from sgm.mapping.furniture_labels import FurnitureLabels
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import needed_to, shorten
from sgm.prior.prior_graph import PriorGraph
from sgm.schema import MOST_METRES
from simulator.trace.importers.frame_looks import begin_looking, count_frames
from simulator.trace.importers.imported_looks import ImportedLooks, TimeOptions
from simulator.yaml_text import load_yaml

_MOST_POSE_BYTES = 1 << 28
_MOST_DEPTH_BYTES = 1 << 26


@dataclass(frozen=True, slots=True)
class CocoOptions(TimeOptions):
    """How detections are read.

    Attributes:
        depth_scale: numbers of a depth image that make a metre: 1000 for millimetres, 5000 for
            TUM RGB-D.
        most_apart: seconds between an image and its pose, at most.
        position_sd: standard deviation of the poses' position, metres.
        angle_sd: standard deviation of their direction, radians.
        ignore: names of what is no thing.
        discover: whether furniture is found beside that of a map.
    """

    depth_scale: float = 1000.0
    most_apart: float = 0.05
    position_sd: float = 0.02
    angle_sd: float = 0.01
    ignore: tuple[str, ...] = ("person",)
    discover: bool = False

    def __post_init__(self) -> None:
        """Raise ValueError if a number is out of range."""
        TimeOptions.__post_init__(self)
        check_at_least(0, position_sd=self.position_sd, angle_sd=self.angle_sd)
        check_at_least(1, depth_scale=self.depth_scale)
        check_at_least(0, most_apart=self.most_apart)


@dataclass(frozen=True, slots=True)
class _Picture:
    """An image that was detected in: its time, its pixels, the stem of its file, what was found."""

    time: float
    intrinsics: Intrinsics
    stem: str
    detections: list[Detection]


def read_coco(
    path: Path,
    poses: Path,
    camera: Path,
    options: CocoOptions | None = None,
    *,
    images: Path | None = None,
    depth: Path | None = None,
    home: HomeMap | None = None,
    areas: Areas | None = None,
    labels: FurnitureLabels | None = None,
    prior: PriorGraph | None = None,
    file: Path | None = None,
) -> ImportedLooks:
    """Let a memory look at detections.

    Args:
        path: an object with images, categories and annotations, or a list of results.
        poses: of the optical frame of the camera in the map, one a line, with its time.
        camera: camera_matrix of the camera (YAML).
        options: how they are read.
        images: the object with images and categories of results.
        depth: folder of depth images, PNG of 16 bits, named as the images; None where annotations
            have a `center`, x, y, z in the map, or nothing can be located.
        home: rooms and furniture; None to find furniture in the detections.
        areas: rooms as polygons, for furniture that is found; None for one room "home".
        labels: what furniture may be called; None for the household's names.
        prior: of the memory; None for the household prior.
        file: new file in which the memory is kept; None for none.

    Raises:
        ValueError: if a file is none of its format, or no image has a time and a pose.
    """
    options = CocoOptions() if options is None else options
    counts: Counter[str] = Counter()
    pictures = _read_pictures(path, images, _read_matrix(camera), counts)
    times, numbers = _read_poses(poses)
    located = [(picture, _find_nearest(times, picture.time)) for picture in pictures]
    timed = [
        (picture, row)
        for picture, row in located
        if abs(times[row] - picture.time) <= options.most_apart
    ]
    counts["images without a pose"] += len(located) - len(timed)
    if not timed:
        raise ValueError(
            f"images must have a time within {options.most_apart:g} s of a pose, got none of "
            f"{len(pictures)} in {path}. Give each a timestamp, a date_captured, or its time as "
            "the name of its file."
        )
    cameras = [_make_pose(times[row], numbers[row], poses, options) for _, row in timed]
    memory = SceneGraphMemory(prior, options.make_clock(timed[0][0].time), path=file)
    looks = Counter[str]()
    live = begin_looking(
        memory,
        home,
        options,
        areas=areas,
        labels=labels,
        discover=options.discover,
        ignore=options.ignore,
        on_look=lambda look: looks.update(("looks",)),
    )
    for (picture, row), pose in zip(timed, cameras, strict=True):
        image = None if depth is None else _read_depth(depth, picture, options, counts)
        live.builder.frame(
            picture.time, pose, picture.intrinsics, picture.detections, image, float(times[row])
        )
    live.finish()
    counts.update(count_frames(live))
    return ImportedLooks(memory, looks["looks"], +counts)


def _read_pictures(
    path: Path, images: Path | None, matrix: list[float], counts: Counter[str]
) -> list[_Picture]:
    """Read images with their detections, in the order of their times."""
    found = _read_json(path)
    about = found if images is None else _read_json(images)
    results = found if isinstance(found, list) else _get_list(found, "annotations", path)
    where = path if images is None else images
    if not isinstance(about, Mapping):
        raise ValueError(
            f"results of COCO must come with their images and categories, got a list alone in "
            f"{path}. Give --images."
        )
    names = {
        row["id"]: row["name"]
        for row in _get_list(about, "categories", where)
        if _has_id(row) and isinstance(row.get("name"), str)
    }
    detections = defaultdict(list)
    for row in results:
        if isinstance(row, Mapping) and row.get("iscrowd") in (1, True):
            counts["annotations of crowds"] += 1  # many things in one box, at no single place
            continue
        try:
            detections[row["image_id"]].append(_read_detection(row, names))
        except (KeyError, TypeError, ValueError, OverflowError):
            counts["annotations that are none"] += 1
    pictures = []
    for row in _get_list(about, "images", where):
        picture = _read_picture(row, matrix, detections)
        if picture is None:
            counts["images without id, size or time"] += 1
        else:
            pictures.append(picture)
    counts["images"] = len(pictures)
    known = {row["id"] for row in _get_list(about, "images", where) if _has_id(row)}
    lost = (len(found) for number, found in detections.items() if number not in known)
    counts["annotations of no image"] = sum(lost)
    return sorted(pictures, key=lambda picture: picture.time)


def _read_json(path: Path) -> Any:
    try:
        return read_json(path)
    except OSError as error:
        where = f"for {path}. Check the path."
        raise make_read_error(error, "detections must be a file that can be read", where) from error
    except ValueError as error:
        raise ValueError(
            f"detections must be JSON, got {error} in {path}. Write it again."
        ) from None


def _is_id(value: Any) -> bool:
    return isinstance(value, (int, str))


def _has_id(row: Any) -> TypeGuard[Mapping[str, Any]]:
    return isinstance(row, Mapping) and _is_id(row.get("id"))


def _get_list(content: Any, name: str, path: Path) -> list[Any]:
    rows = content.get(name) if isinstance(content, Mapping) else None
    if not isinstance(rows, list):
        raise ValueError(
            f"file of COCO must have the list '{name}', got {shorten(content, 80)} in {path}. Give "
            "an object with images, categories and annotations."
        )
    return rows


def _read_detection(row: Mapping[str, Any], names: Mapping[Any, str]) -> Detection:
    """Read an annotation or a result; raises an error of the value if it is none."""
    left, top, width, height = map(float, row["bbox"])
    track, center = row.get("track_id"), row.get("center")
    if not (track is None or _is_id(track)):
        raise TypeError("track_id")
    if center is not None and max(map(abs, center)) > MOST_METRES:
        raise ValueError("center")
    return Detection(
        names[row["category_id"]].replace("_", " "),
        row.get("score", 1.0),
        (left, top, left + width, top + height),
        center,
        track=track,
    )


def _read_picture(
    row: Any, matrix: list[float], detections: Mapping[Any, list[Detection]]
) -> _Picture | None:
    if not isinstance(row, Mapping):
        return None
    stem = Path(str(row.get("file_name", ""))).stem
    time = _read_time(row, stem)
    number = row.get("id")
    try:
        intrinsics = Intrinsics.from_matrix(matrix, row["width"], row["height"])
    except (KeyError, ValueError):  # of the size, as the matrix was checked
        return None
    if time is None or not _is_id(number):
        return None
    return _Picture(time, intrinsics, stem, detections.get(number, []))


def _read_time(row: Mapping[str, Any], stem: str) -> float | None:
    """Return when an image was taken, seconds: a timestamp, a date in UTC, or a file's name."""
    stamp = row.get("timestamp")
    if is_number(stamp) and is_finite(stamp):
        return float(stamp)
    try:
        date = datetime.fromisoformat(str(row.get("date_captured", "")).replace("Z", "+00:00"))
        return (date if date.tzinfo else date.replace(tzinfo=timezone.utc)).timestamp()
    except ValueError:
        pass
    try:
        time = float(stem)
    except ValueError:
        return None
    return time if is_finite(time) else None


def _read_poses(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return the times (n,) of poses, increasing, and their positions and quaternions (n, 7)."""
    try:
        text = read_file(path, _MOST_POSE_BYTES).decode("utf-8", "replace")
    except OSError as error:
        where = f"for {path}. Check the path."
        raise make_read_error(error, "poses must be a file that can be read", where) from error
    rows = []
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            values = [float(word) for word in line.replace(",", " ").split()]
        except ValueError:
            values = []
        if len(values) != 8 or not np.isfinite(values).all():
            raise ValueError(
                "pose must be timestamp tx ty tz qx qy qz qw, got "
                f"{shorten(line.strip(), 60)} in line {number} of {path}. Mend the line."
            )
        rows.append(values)
    if not rows:
        raise ValueError(f"poses must have a line each, got none in {path}. Record them.")
    table = np.array(sorted(rows))
    return table[:, 0], table[:, 1:]


def _find_nearest(times: np.ndarray, time: float) -> int:
    """Return the row of the pose nearest to a time."""
    after = int(np.searchsorted(times, time))
    if after == 0 or (after < len(times) and times[after] - time <= time - times[after - 1]):
        return after
    return after - 1


def _make_pose(time: float, numbers: np.ndarray, path: Path, options: CocoOptions) -> Pose:
    """Return the pose of a line, x, y, z and a quaternion (7,)."""
    try:
        if np.abs(numbers[:3]).max() > MOST_METRES:
            raise ValueError(
                f"position of a camera must lie within {MOST_METRES:g} m, got "
                f"{shorten(numbers[:3].tolist())}. Give metres."
            )
        return Pose.from_quaternion(numbers[:3], numbers[3:], options.position_sd, options.angle_sd)
    except ValueError as error:
        raise ValueError(f"{error} It is the pose at {time:.16g} in {path}.") from None


def _read_matrix(path: Path) -> list[float]:
    """Return camera_matrix of a calibration, (9,), row by row."""
    data = load_yaml("camera", path)
    matrix = data.get("camera_matrix") if isinstance(data, Mapping) else None
    values = matrix.get("data") if isinstance(matrix, Mapping) else None
    if not isinstance(values, list) or len(values) != 9 or not all(map(is_finite, values)):
        raise ValueError(
            f"camera must have the nine numbers of camera_matrix: data, got {shorten(data, 80)} in "
            f"{path}. Calibrate it with camera_calibration of ROS, or write the file."
        )
    try:
        Intrinsics.from_matrix(values, 1, 1)
    except ValueError as error:
        raise ValueError(f"{error} It is the camera in {path}.") from None
    return [float(value) for value in values]


def _read_depth(
    folder: Path, picture: _Picture, options: CocoOptions, counts: Counter[str]
) -> np.ndarray | None:
    """Return the depth of a picture in metres, 0 where there is none; None without an image."""
    with needed_to("read depth images", install="pillow"):
        from PIL import Image
    path = folder / f"{picture.stem}.png"
    try:
        content = read_file(path, _MOST_DEPTH_BYTES)
        with Image.open(io.BytesIO(content), formats=["PNG"]) as image:
            is_depth = image.mode in ("I", "I;16") and image.size == (
                picture.intrinsics.width,
                picture.intrinsics.height,
            )
            values = np.array(image, dtype=np.float32) if is_depth else None
    except (OSError, ValueError, SyntaxError):
        values = None
    if values is None:
        counts["images without depth"] += 1
        return None
    return values / np.float32(options.depth_scale)
