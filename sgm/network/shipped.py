"""Which networks ship with the package, and where others are; needs no torch."""

from __future__ import annotations

from pathlib import Path

from sgm.files import MissingFileError, compute_checksum
from sgm.messages import shorten
from sgm.network.hub import PREFIX, fetch

CONFIG = "config.json"  # of an exported folder
NEW = ".new"  # ends the name of a file that the config will name when the export has ended
PRETRAINED = Path(__file__).parents[1] / "pretrained"


def find_part(folder: Path, name: str, checksum: str | None) -> Path:
    """Return the file of an exported folder that its config names by a checksum.

    A new one, if an export was stopped after the config was written.

    Raises:
        OSError: if a new one cannot be read.
    """
    new = folder / f"{name}{NEW}"
    return new if new.is_file() and compute_checksum(new) == checksum else folder / name


def list_shipped() -> list[str]:
    """List the networks that ship with the package, by name."""
    return sorted(path.parent.name for path in PRETRAINED.glob(f"*/{CONFIG}"))


def split_name(text: str) -> tuple[str | None, str]:
    """Split `NAME=SOURCE`; the name is None of a source alone, which may be a path with "=" in it.

    Raises:
        ValueError: if there is no name before "=", or no source after it.
    """
    name, separator, source = text.partition("=")
    if not separator or Path(text).exists():
        return None, text
    if not name or not source:
        raise ValueError(
            f"checkpoint must be SOURCE or NAME=SOURCE, got {shorten(text)}. Name the network and "
            "where it is, or leave the name out."
        )
    return name, source


def find_trained(source: str | Path) -> Path:
    """Find the exported folder or checkpoint that a source names, without reading it.

    Args:
        source: as in `load_trained`, or "hf://owner/name" (`sgm.network.hub`).

    Raises:
        ModuleNotFoundError: if it is of a hub, and huggingface_hub is not installed.
        ValueError: if there is no such file or folder.
    """
    if not isinstance(source, (str, Path)):
        raise ValueError(
            f"checkpoint must be named by a text or a path, got {shorten(source)}. Name a file, an "
            f"exported folder or one of {', '.join(list_shipped())}."
        )
    if source in list_shipped():
        return PRETRAINED / source
    if isinstance(source, str) and source.startswith(PREFIX):
        folder = fetch(source)
        if not (folder / CONFIG).is_file():
            raise ValueError(
                f"network of a hub must be an exported folder, got none with {CONFIG} at "
                f"{shorten(source)}. Name its folder behind #, or export with `python -m "
                "nep.export`."
            )
        return folder
    path = Path(source)
    if not path.exists():
        raise MissingFileError(
            "checkpoint must be a file that can be read, an exported folder or one of "
            f"{', '.join(list_shipped())}, got {shorten(str(source))}. Train one with `python -m "
            "nep.fit`, or check the path."
        )
    return path
