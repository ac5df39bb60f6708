"""A recording of a robot, a bag of ROS 2, as a memory; reads sqlite3 and MCAP without ROS."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from sgm.checks import check_at_least
from sgm.finder.home_map import HomeMap
from sgm.layout.areas import Areas
from sgm.mapping.furniture_labels import FurnitureLabels
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import shorten
from sgm.prior.prior_graph import PriorGraph
from sgm.ros.camera_feed import CameraFeed
from sgm.ros.live_memory import LiveMemory
from simulator.trace.importers.bag_files import open_bag
from simulator.trace.importers.bag_messages import (
    CAMERA_INFO,
    COMPRESSED,
    DEFINITIONS,
    DETECTIONS_2D,
    DETECTIONS_3D,
    IMAGE,
    POSE,
    TRANSFORMS,
    YOLO,
)
from simulator.trace.importers.frame_looks import begin_looking, count_frames
from simulator.trace.importers.imported_looks import ImportedLooks, TimeOptions
from simulator.yaml_text import load_yaml

MOST_MESSAGE_BYTES = 1 << 26  # 64 MiB: an image of 16 million depths


@dataclass(frozen=True, slots=True)
class BagOptions(TimeOptions):
    """What of a bag is read, and how.

    A topic that is not there, and was not named, is the only one of its type in the bag.

    Attributes:
        detections: topic of a Detection2DArray or Detection3DArray of vision_msgs, or of a
            DetectionArray of yolo_msgs.
        depth: topic of the depth image, raw or compressed, registered to the camera of the
            detections; "" for none.
        camera_info: topic of the camera.
        tf: topic of the transforms.
        tf_static: topic of those that never change.
        pose: topic of a PoseWithCovarianceStamped, for how sure the position is; "" for none.
        map_frame: frame of the map, where no map says it; `odom` for a robot that has no other.
        camera_frame: optical frame of the camera; that of the CameraInfo if left out.
        class_names: file with a name a line, where class ids are numbers.
        position_sd: how well the robot knows its position, metres, where no pose says.
        angle_sd: likewise its yaw, radians.
        ignore: names of what is no thing, such as person and wall.
        discover: whether furniture that is on no map is found, where there is a map, too.
    """

    detections: str = "/detections"
    depth: str = "/camera/depth/image_raw"
    camera_info: str = "/camera/camera_info"
    tf: str = "/tf"
    tf_static: str = "/tf_static"
    pose: str = "/amcl_pose"
    map_frame: str = "map"
    camera_frame: str | None = None
    class_names: Path | None = None
    position_sd: float = 0.05
    angle_sd: float = 0.02
    ignore: tuple[str, ...] = ()
    discover: bool = False

    def __post_init__(self) -> None:
        """Raise ValueError if a number is out of range."""
        TimeOptions.__post_init__(self)
        check_at_least(0, position_sd=self.position_sd, angle_sd=self.angle_sd)


@dataclass(frozen=True, slots=True)
class BagLooks(ImportedLooks):
    """A bag that was read.

    `topics` are those that were read, by the option that names them. `gap` says what is missing
    where no frame could be located, "" for nothing.
    """

    topics: Mapping[str, str]
    gap: str = ""

    def summarise(self) -> str:
        """Say in a few lines what was read and what was left out."""
        topics = ", ".join(f"{topic} ({option})" for option, topic in self.topics.items())
        gap = f"\nnote: {self.gap}" if self.gap else ""
        looks, read = ImportedLooks.summarise(self).split("\n")
        return f"{looks}\ntopics: {topics}\n{read}{gap}"


def load_home_map(path: Path) -> HomeMap:
    """Read a map of a home (YAML).

    Raises:
        ValueError: if it cannot be read, or something is missing or malformed.
    """
    return HomeMap.from_values(load_yaml("map", path), str(path))


def load_areas(path: Path) -> Areas:
    """Read rooms as polygons (YAML, or JSON).

    Raises:
        ValueError: if it cannot be read, or holds no polygons by name.
    """
    return Areas.from_values(load_yaml("areas", path), str(path))


def load_furniture_labels(path: Path) -> FurnitureLabels:
    """Read what furniture is called, beside the household's names (YAML, or JSON).

    Raises:
        ValueError: if it cannot be read, or holds no names.
    """
    return FurnitureLabels.from_values(load_yaml("furniture_names", path), str(path))


def read_bag(
    path: Path,
    home: HomeMap | None = None,
    options: BagOptions | None = None,
    *,
    areas: Areas | None = None,
    labels: FurnitureLabels | None = None,
    prior: PriorGraph | None = None,
    file: Path | None = None,
) -> BagLooks:
    """Let a memory look at a recording.

    Messages are read by definitions of this package, never by those that a bag brings, and only
    from the topics that are named. What cannot be read is counted.

    Args:
        path: folder of the bag, or a file of its storage, .mcap or .db3. Without metadata.yaml, the
            files of the folder are read in the order of their names.
        home: rooms and furniture, in the frame of the map; None to find furniture in the frames
            (`FurnitureMapper`).
        options: topics and how they are read.
        areas: rooms as polygons, for furniture that is found; None for one room "home".
        labels: what furniture may be called; None for the household's names.
        prior: of the memory; None for the household prior.
        file: new file in which the memory is kept; None for none.

    Raises:
        ModuleNotFoundError: if rosbags is not installed.
        ValueError: if it is no bag, or lacks what is needed; names the topics that it has.
        OSError: if a file cannot be read.
    """
    options = BagOptions() if options is None else options
    counts: Counter[str] = Counter()
    reader = open_bag(path)
    try:
        topics = _find_topics(reader.connections, path, options)
        option_of = {topic: option for option, topic in topics.items()}
        names = _read_names(options.class_names)
        live: LiveMemory | None = None
        looks = Counter[str]()
        for topic, message, seconds in _list_messages(reader, path, option_of, counts):
            option = option_of[topic]
            if live is None:
                memory = SceneGraphMemory(prior, options.make_clock(seconds), path=file)
                live = begin_looking(
                    memory,
                    home,
                    options,
                    areas=areas,
                    labels=labels,
                    discover=options.discover,
                    ignore=options.ignore,
                    on_look=lambda look: looks.update(("looks",)),
                    map_frame=options.map_frame if home is None else home.frame,
                    camera_frame=options.camera_frame,
                    names=names,
                    pose_sd=(options.position_sd, options.angle_sd),
                    uses_depth="depth" in topics,
                )
                known = () if home is None else home.furniture
                for number, furniture in zip(memory.furniture_ids, known, strict=True):
                    if furniture.is_open:
                        live.builder.set_open(number)
            _take(live.feed, option, message)
    finally:
        reader.close()
    if live is None:
        raise ValueError(
            f"bag must have messages of {', '.join(option_of)}, got none that can be read in "
            f"{path}. Record them, or name other topics."
        )
    live.finish()
    counts.update(live.feed.counts)
    counts.update(count_frames(live))
    return BagLooks(live.memory, looks["looks"], counts, topics, live.feed.find_gap())


@dataclass(frozen=True, slots=True)
class _Wanted:
    """A topic that is read: its option, its types, and how to choose where none was named."""

    option: str
    kinds: tuple[str, ...]
    is_needed: bool = False
    says: str = ""  # what its name must hold, to be taken without being named
    never: str = "\n"  # what it must not hold then
    avoids: tuple[str, ...] = ()  # what it should not hold, where another one is there


_WANTED = (
    _Wanted("detections", (DETECTIONS_2D, DETECTIONS_3D, YOLO), True, avoids=("_3d", "tracking")),
    _Wanted("camera_info", (CAMERA_INFO,), True, avoids=("depth", "infra")),
    _Wanted("tf", (TRANSFORMS,), True, never="static"),
    _Wanted("tf_static", (TRANSFORMS,), says="static"),
    _Wanted("depth", (IMAGE, COMPRESSED), says="depth", avoids=("compressed", "/depth/")),
    _Wanted("pose", (POSE,)),
)


def _find_topics(connections: list[Any], path: Path, options: BagOptions) -> dict[str, str]:
    """Return the topic of each option that is read; those that are needed must be there."""
    type_of = {connection.topic: connection.msgtype for connection in connections}
    found: dict[str, str] = {}
    usual = BagOptions()
    for wanted in _WANTED:
        topic = getattr(options, wanted.option)
        if topic not in type_of and topic == getattr(usual, wanted.option):
            topic = _choose_topic(wanted, type_of) or topic
        needs_depth = type_of.get(found.get("detections", "")) == DETECTIONS_2D
        is_needed = wanted.is_needed or (wanted.option == "depth" and bool(topic) and needs_depth)
        if type_of.get(topic) in wanted.kinds:
            found[wanted.option] = topic
        elif is_needed or topic in type_of:
            known = ", ".join(
                f"{name} ({message_type})" for name, message_type in sorted(type_of.items())
            )
            raise ValueError(
                f"bag must have the topic {topic} of type {' or '.join(wanted.kinds)}, got "
                f"{type_of.get(topic, 'no such topic')} in {path}. Name another one with "
                f"--{wanted.option}; there are: {shorten(known) if known else 'none'}."
            )
    return found


def _choose_topic(wanted: _Wanted, type_of: Mapping[str, str]) -> str | None:
    """Return the only topic that may be meant; None if there is none, or several."""
    fits = [
        name
        for name, message_type in type_of.items()
        if message_type in wanted.kinds and wanted.says in name and wanted.never not in name
    ]
    for word in wanted.avoids:
        fits = [name for name in fits if word not in name] or fits
    return fits[0] if len(fits) == 1 else None


def _take(feed: CameraFeed, option: str, message: Any) -> None:
    """Hand a message on, by the option that names its topic."""
    if option == "detections":
        feed.take_detections(message)
    elif option == "camera_info":
        feed.take_camera(message)
    elif option == "depth":
        feed.take_depth(message)
    elif option == "pose":
        feed.take_pose(message)
    else:
        feed.take_transforms(message, is_still=option == "tf_static")


@cache  # it compiles what reads a type when it meets the first message of it
def _load_messages() -> Any:
    """Return what reads messages: those of ROS 2, and those of `DEFINITIONS`."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    for name, text in DEFINITIONS.items():
        store.register(get_types_from_msg(text, name))
    return store


def _list_messages(
    reader: Any, path: Path, topics: Mapping[str, str], counts: Counter[str]
) -> Iterator[tuple[str, Any, float]]:
    """Yield topic, message and seconds of what can be read, in order."""
    store = _load_messages()
    wanted = [connection for connection in reader.connections if connection.topic in topics]
    messages = reader.messages(connections=wanted)
    while True:
        try:
            connection, nanoseconds, data = next(messages)
        except StopIteration:
            return
        except Exception as error:  # of sqlite, MCAP, zstd, lz4: a file that was cut or altered
            raise ValueError(
                f"storage of a bag must be whole, got {shorten(str(error)[:200])} in {path}. Run "
                "`ros2 bag reindex`, or leave the file out."
            ) from None
        if len(data) > MOST_MESSAGE_BYTES:
            counts["messages that are too large"] += 1
            continue
        try:
            message = store.deserialize_cdr(data, connection.msgtype)
        except Exception:  # whatever a message holds that was cut or altered
            counts["messages that cannot be read"] += 1
            continue
        yield connection.topic, message, nanoseconds * 1e-9


def _read_names(path: Path | None) -> list[str] | None:
    """Read the names of class ids, one a line."""
    if path is None:
        return None
    try:
        return path.read_text("utf-8").splitlines()[:100_000]
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(
            f"class_names must be a text with a name a line, got {shorten(str(error))} for {path}. "
            "Check the path."
        ) from None
