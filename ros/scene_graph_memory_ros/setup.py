"""Package of the node, for ament_python; the memory itself is the package `sgm`."""

from setuptools import setup

NAME = "scene_graph_memory_ros"

setup(
    name=NAME,
    version="0.1.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", ["launch/memory.launch.xml"]),
        (f"share/{NAME}/config", ["config/memory.yaml"]),
        (f"share/{NAME}/rviz", ["rviz/memory.rviz"]),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    license="Apache-2.0",
    description="A node around the scene graph memory",
    entry_points={"console_scripts": [f"memory_node = {NAME}.run:main"]},
)
