"""The parameters of the node: what each is, and what it is if it is left out."""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from typing import Any

import yaml
from rcl_interfaces.msg import ParameterDescriptor

from sgm.checks import check_at_least
from sgm.messages import shorten

# Messages of detections, and the packages that define them.
DETECTIONS = {
    "Detection2DArray": "vision_msgs.msg",
    "Detection3DArray": "vision_msgs.msg",
    "DetectionArray": "yolo_msgs.msg",
}


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter.

    Attributes:
        usual: its value if it is left out; says its type, too.
        about: what it is, for `ros2 param describe`.
    """

    usual: Any
    about: str


# As config/memory.yaml lists them.
PARAMETERS = {
    "map_file": Parameter("", "rooms and furniture with boxes (YAML); empty: found in the frames"),
    "areas_file": Parameter("", "rooms as polygons (YAML), for furniture that is found"),
    "furniture_names_file": Parameter("", "further names of furniture by label (YAML)"),
    "memory_file": Parameter("", "memory that is gone on with and saved; empty: none"),
    "save_seconds": Parameter(60.0, "seconds from one save of the memory to the next"),
    "network": Parameter("", "any_home, or folder of an exported network; empty: heuristics"),
    "map_frame": Parameter("map", "frame of the map, in which furniture and poses are"),
    "base_frame": Parameter("base_link", "frame of the robot's base, from which searches begin"),
    "camera_frame": Parameter("", "optical frame of the camera; empty: that of its messages"),
    # ROS has no list without a value: the empty name is none.
    "ignore": Parameter([""], "names of what is no thing, such as person and wall"),
    "detections_type": Parameter(
        "Detection2DArray", "or Detection3DArray of vision_msgs, DetectionArray of yolo_msgs"
    ),
    "uses_depth": Parameter(True, "whether frames wait for depth images"),
    "compressed_depth": Parameter(False, "whether depth images are CompressedImage"),
    "scene_graph": Parameter(False, "whether Hydra's DsgUpdate gives furniture (hydra_msgs)"),
    "step_seconds": Parameter(600.0, "length of a time step of a new memory"),
    "accept_jump": Parameter(False, "whether the first time is right after months without power"),
}


def read_parameters(node: Any) -> dict[str, Any]:
    """Declare all parameters of a node, which are set once, and return their values.

    Others that are given are warned of: a file for all nodes of a robot may have them.

    Raises:
        ValueError: if a number is out of range.
    """
    read = {}
    for name, parameter in PARAMETERS.items():
        about = ParameterDescriptor(description=parameter.about, read_only=True)
        value = node.declare_parameter(name, parameter.usual, about).value
        read[name] = parameter.usual if value is None else value  # a list without a value is None
    check_at_least(1, save_seconds=read["save_seconds"], step_seconds=read["step_seconds"])
    for name in getattr(node, "_parameter_overrides", ()):  # rclpy gives them in no other way
        if not node.has_parameter(name) and not name.startswith("qos_overrides."):
            near = get_close_matches(name, PARAMETERS, 1)
            node.get_logger().warning(
                f"parameters must be of this node, got {shorten(name)}, which is ignored. "
                + (f"Did you mean {near[0]}?" if near else "See config/memory.yaml.")
            )
    return read


def find_path(name: str) -> Path | None:
    """Return the path of a parameter, in which ~ is the home folder; None for none."""
    return Path(name).expanduser() if name else None


def read_yaml(name: str) -> Any:
    """Return what a YAML file holds; raises ValueError that names it if it is none."""
    try:
        return yaml.safe_load(Path(name).expanduser().read_text("utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        said = " ".join(str(error).split())
        raise ValueError(
            f"file of a parameter must be YAML, got {shorten(said)} in {name}. Correct it."
        ) from error


def find_type(name: str) -> Any:
    """Return the type of detections of a name; its package need not be there for the others.

    Raises:
        ValueError: if there is no such type.
        ModuleNotFoundError: if its package is not built.
    """
    if name not in DETECTIONS:
        raise ValueError(
            f"detections_type must be one of {', '.join(DETECTIONS)}, got {name!r}. Choose one."
        )
    return find_message(DETECTIONS[name], name, f"detections_type {name}")


def find_message(module: str, name: str, use: str) -> Any:
    """Return a type of message of a package that not every robot has.

    Args:
        module: such as "yolo_msgs.msg".
        name: such as "DetectionArray".
        use: what asks for it, for the message.

    Raises:
        ModuleNotFoundError: if the package is not there, or has no such type.
    """
    package = module.partition(".")[0]
    try:
        return getattr(import_module(module), name)
    except (ModuleNotFoundError, AttributeError) as error:
        found = "none" if getattr(error, "name", None) == package else error
        raise ModuleNotFoundError(
            f"package {package} must be in the workspace for {use}, got {found}. Put it into src, "
            "build it, and read install/setup.bash again; or choose another value."
        ) from None
