"""Finding the data files of the two packages that the default prior is built from."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from sgm.messages import shorten

INSTALL = 'Install them with `pip install --no-deps "procthor==0.0.1.dev2" "bddl==3.6.0"`'


def find_package_data(package: str, folder: str) -> Path:
    """Folder of an installed package, found without importing the package.

    The packages import simulators and graph libraries at the top; their data files need none.

    Raises:
        ModuleNotFoundError: if the package is not installed; says how to install it.
    """
    spec = find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        raise ModuleNotFoundError(
            f"building the default prior must find the package {shorten(package)}, got none. "
            f"{INSTALL}."
        )
    path = Path(spec.submodule_search_locations[0], folder)
    if not path.is_dir():
        raise ModuleNotFoundError(
            f"package {shorten(package)} must hold the folder {shorten(folder)}, got none at "
            f"{path}. {INSTALL}."
        )
    return path
