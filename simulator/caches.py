"""Where other packages keep what they want to find again."""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import tempfile
from pathlib import Path


def keep_home_clean() -> None:
    """Let matplotlib keep its list of fonts in a temporary folder, if it has none at home.

    It would make two folders in the home folder of its user, and print advice where it
    cannot. Has an effect before matplotlib is imported, and none where it was used before or
    `MPLCONFIGDIR` says where.
    """
    if "matplotlib" in sys.modules or os.environ.get("MPLCONFIGDIR"):
        return
    home = Path(os.path.expanduser("~"))
    config = Path(os.environ.get("XDG_CONFIG_HOME") or home / ".config") / "matplotlib"
    cache = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache") / "matplotlib"
    if config.exists() or cache.exists() or (home / ".matplotlib").exists():
        return
    folder = tempfile.mkdtemp(prefix="matplotlib-")
    os.environ["MPLCONFIGDIR"] = folder
    atexit.register(_remove, folder, os.getpid())


def _remove(folder: str, process: int) -> None:
    if os.getpid() == process:  # not in a fork
        shutil.rmtree(folder, ignore_errors=True)
