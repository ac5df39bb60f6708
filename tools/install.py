"""Install the packages of this repository into an environment: `make install` calls it.

With uv, which downloads many packages at once and is itself a small package of pip; with pip where
there is no uv. Both show what is downloaded. Torch comes without CUDA where that can be had: from
the indexes that pip is set up with, or else from the index of torch's own builds for CPUs.
"""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence

# Settings of pip, and what uv calls the same; uv reads none of pip's.
_SETTINGS = {
    "index-url": "UV_DEFAULT_INDEX",
    "extra-index-url": "UV_INDEX",
    "find-links": "UV_FIND_LINKS",
    "cert": "SSL_CERT_FILE",
}


def find_settings(listed: str) -> dict[str, str]:
    """Turn what `pip config list` prints into variables of uv; the last line of a name counts."""
    found = {}
    for line in listed.splitlines():
        name, _, value = line.partition("=")
        setting = _SETTINGS.get(name.rpartition(".")[2])
        if setting is not None:
            links = value.strip("'\"").replace("\\n", " ").split()
            found[setting] = ("," if setting == "UV_FIND_LINKS" else " ").join(links)
    return found


def make_command(packages: Sequence[str], settings: Mapping[str, str]) -> list[str]:
    """Make the command of uv."""
    command = [sys.executable, "-m", "uv", "pip", "install", "--python", sys.executable]
    if {"UV_DEFAULT_INDEX", "UV_INDEX", "UV_FIND_LINKS"} & settings.keys():
        # As pip does: the newest of all indexes.
        command += ["--index-strategy", "unsafe-best-match"]
    else:
        command += ["--torch-backend", "cpu"]
    return [*command, "--compile-bytecode", *packages]


def main(packages: Sequence[str]) -> int:
    """Install what pip would be asked for in the same words; return the status."""
    if {"-h", "--help"} & {*packages}:
        print(f"usage: python -m tools.install PACKAGES ...\n\n{__doc__}")
        return 0
    pip = [sys.executable, "-m", "pip"]
    quiet = ["install", "--quiet", "--disable-pip-version-check"]
    if importlib.util.find_spec("uv") is None:
        subprocess.run([*pip, *quiet, "uv"], check=False)
    if (
        subprocess.run(
            [sys.executable, "-c", "import uv"], capture_output=True, check=False
        ).returncode
        == 0
    ):
        listed = subprocess.run(
            [*pip, "config", "list"], capture_output=True, text=True, check=False
        )
        settings = find_settings(listed.stdout)
        environment = {**settings, **os.environ}  # what is set for uv itself counts
        done = subprocess.run(make_command(packages, settings), env=environment, check=False)
        if done.returncode == 0:
            return 0
        print("uv could not install this; pip tries it now, which takes longer", flush=True)
    return subprocess.run(
        [*pip, "install", "--disable-pip-version-check", *packages], check=False
    ).returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
