"""ROS 2 in a folder of its own: both packages of `ros/` are built, and the running node is tested.

    python -m tests.ros.workspace [arguments of pytest]

In the folder .ros are a virtual environment of Python 3.12 with ROS 2 Jazzy from packages of pip,
`sgm` as `pip install ./core` installs it, and a colcon workspace. What is there is used again. The
packages tf2_msgs and vision_msgs are not among those of pip: the messages that the node reads of
them are made here, with the names and fields that they have in ROS.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tests.wheels import find_python

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / ".ros"
ENVIRONMENT, SOURCE, INSTALLED = FOLDER / "env", FOLDER / "src", FOLDER / "install"
REQUIREMENTS = ROOT / "tests" / "ros" / "requirements.txt"
TEST_PACKAGES = ("pyyaml", "pillow")  # maps and depth images
PYTHON = "3.12"
# The Python of those who packed the wheels; CMake files of the packages name it.
PACKED = {
    "/opt/python/cp312-cp312/include/python3.12": "include",
    "/opt/python/cp312-cp312/lib/python3.12/site-packages": "purelib",
}
# Fields of messages, by package and type.
MESSAGES = {
    "tf2_msgs": {"TFMessage": ["geometry_msgs/TransformStamped[] transforms"]},
    "vision_msgs": {
        "Point2D": ["float64 x", "float64 y"],
        "Pose2D": ["vision_msgs/Point2D position", "float64 theta"],
        "BoundingBox2D": ["vision_msgs/Pose2D center", "float64 size_x", "float64 size_y"],
        "BoundingBox3D": ["geometry_msgs/Pose center", "geometry_msgs/Vector3 size"],
        "ObjectHypothesis": ["string class_id", "float64 score"],
        "ObjectHypothesisWithPose": [
            "ObjectHypothesis hypothesis",
            "geometry_msgs/PoseWithCovariance pose",
        ],
        **{
            f"Detection{sides}": [
                "std_msgs/Header header",
                "ObjectHypothesisWithPose[] results",
                f"BoundingBox{sides} bbox",
                "string id",
            ]
            for sides in ("2D", "3D")
        },
        **{
            f"Detection{sides}Array": [
                "std_msgs/Header header",
                f"Detection{sides}[] detections",
            ]
            for sides in ("2D", "3D")
        },
    },
}
PACKAGE_XML = """<?xml version="1.0"?>
<package format="3">
  <name>{name}</name>
  <version>0.0.0</version>
  <description>Messages with the names and fields that they have in ROS, for a test.</description>
  <maintainer email="noreply@example.org">Scene Graph Memory developers</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <build_depend>rosidl_default_generators</build_depend>
  <depend>geometry_msgs</depend>
  <depend>std_msgs</depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
"""
CMAKE_LISTS = """cmake_minimum_required(VERSION 3.16)
project({name})
find_package(ament_cmake REQUIRED)
find_package(geometry_msgs REQUIRED)
find_package(std_msgs REQUIRED)
find_package(rosidl_default_generators REQUIRED)
rosidl_generate_interfaces({name} {files} DEPENDENCIES geometry_msgs std_msgs)
ament_package()
"""


def install() -> None:
    """Make the environment of the requirements, unless it is there."""
    wanted, stamp = REQUIREMENTS.read_text("utf-8"), FOLDER / "installed.txt"
    if stamp.exists() and stamp.read_text("utf-8") == wanted:
        return
    stamp.unlink(missing_ok=True)
    print(f"Installing ROS 2 into {ENVIRONMENT}: some minutes the first time", flush=True)
    python = find_python((PYTHON,))
    subprocess.run([python, "-m", "venv", "--clear", ENVIRONMENT], check=True)
    pip: list[str | Path] = [
        ENVIRONMENT / "bin" / "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
    ]
    subprocess.run([*pip, "--requirement", REQUIREMENTS, *TEST_PACKAGES], check=True)
    ask = "import sysconfig; print(sysconfig.get_paths()['include'])"
    told = subprocess.run([python, "-c", ask], check=True, capture_output=True, text=True)
    paths = {
        "include": told.stdout.strip(),
        "purelib": str(ENVIRONMENT / "lib" / f"python{PYTHON}" / "site-packages"),
    }
    for file in ENVIRONMENT.glob("share/*/cmake/*.cmake"):
        text = file.read_text("utf-8")
        for packed, name in PACKED.items():
            text = text.replace(packed, paths[name])
        file.write_text(text, encoding="utf-8")
    stamp.write_text(wanted, encoding="utf-8")


def write_messages() -> None:
    """Write the packages of messages that pip does not have."""
    for name, types in MESSAGES.items():
        files = [f"msg/{type_name}.msg" for type_name in types]
        texts = {
            "package.xml": PACKAGE_XML.format(name=name),
            "CMakeLists.txt": CMAKE_LISTS.format(name=name, files=" ".join(files)),
            **{
                f"msg/{type_name}.msg": "".join(f"{field}\n" for field in fields)
                for type_name, fields in types.items()
            },
        }
        for path, text in texts.items():
            file = SOURCE / name / path
            if not file.exists() or file.read_text("utf-8") != text:  # else it is built again
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(text, encoding="utf-8")


def make_variables() -> dict[str, str]:
    """Return the variables of a shell in which both setup files were read."""
    packages = f"lib/python{PYTHON}/site-packages"
    return {
        **os.environ,
        "PATH": f"{ENVIRONMENT}/bin:{os.environ['PATH']}",
        "LD_LIBRARY_PATH": f"{INSTALLED}/lib:{ENVIRONMENT}/lib",
        "AMENT_PREFIX_PATH": f"{INSTALLED}:{ENVIRONMENT}",
        "CMAKE_PREFIX_PATH": f"{INSTALLED}:{ENVIRONMENT}",
        "PYTHONPATH": f"{INSTALLED}/{packages}:{ENVIRONMENT}/{packages}",
        "ROS_DISTRO": "jazzy",
        "ROS_VERSION": "2",
        "ROS_PYTHON_VERSION": "3",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": str(1 + os.getpid() % 100),  # apart from others on this machine
        "ROS_HOME": str(FOLDER / "home"),
    }


def build(variables: dict[str, str]) -> None:
    """Build all packages, those of `ros/` from where they lie, and install `sgm` as README says."""
    python = ENVIRONMENT / "bin" / "python"
    pip: list[str | Path] = [python, "-m", "pip", "install", "--quiet"]
    subprocess.run([*pip, ROOT / "core"], check=True)
    INSTALLED.mkdir(parents=True, exist_ok=True)
    places: list[str | Path] = ["--log-base", FOLDER / "log", "build", "--merge-install"]
    places += ["--build-base", FOLDER / "build", "--install-base", INSTALLED]
    options: list[str | Path] = ["--parallel-workers", "1", "--base-paths", ROOT / "ros", SOURCE]
    cmake = ["--cmake-args", "-DBUILD_TESTING=OFF", f"-DPython3_EXECUTABLE={python}"]
    colcon: list[str | Path] = [python, "-m", "colcon", *places, *options, *cmake]
    subprocess.run(colcon, cwd=FOLDER, env=variables, check=True)


def main() -> int:
    """Make what is missing, and run the tests; return pytest's status."""
    FOLDER.mkdir(exist_ok=True)
    install()
    write_messages()
    variables = make_variables()
    build(variables)
    # Without the fixtures of all other tests, whose packages are not there.
    pytest: list[str | Path] = [
        ENVIRONMENT / "bin" / "python",
        "-m",
        "pytest",
        "--noconftest",
        "-q",
    ]
    pytest += ["-W", "default::DeprecationWarning"]  # of lark, which rclpy brings
    tests = sys.argv[1:] or ["tests/ros/test_running_node.py"]
    return subprocess.run([*pytest, *tests], cwd=ROOT, env=variables).returncode


if __name__ == "__main__":
    sys.exit(main())
