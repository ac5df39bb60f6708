"""Builds `sgm`: its code lies in ../sgm in the repository, beside this file in an sdist."""

import re
import shutil
from pathlib import Path

from setuptools import find_packages, setup
from setuptools.command.sdist import sdist

HERE = Path(__file__).resolve().parent
SOURCES = "." if (HERE / "sgm").is_dir() else ".."


class SourceDistribution(sdist):
    """A source distribution with the code, from which wheels are built without the repository."""

    def make_release_tree(self, base_dir, files):
        """Copy `sgm` beside the files that setuptools finds in this folder."""
        super().make_release_tree(base_dir, [name for name in files if not name.startswith("..")])
        target = Path(base_dir) / "sgm"
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(HERE / SOURCES / "sgm", target, ignore=ignored, dirs_exist_ok=True)


readme = (HERE / "README.md").read_text(encoding="utf-8")
setup(
    package_dir={"": SOURCES},
    packages=find_packages(SOURCES, include=["sgm", "sgm.*"]),
    # Links to files of the repository lead nowhere on an index.
    long_description=re.sub(r"!?\[([^\]]*)\]\((?!https?:)[^)]*\)", r"\1", readme),
    cmdclass={"sdist": SourceDistribution},
)
