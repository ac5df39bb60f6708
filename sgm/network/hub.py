"""Networks that others share on a hub of models, by `huggingface_hub`."""

from __future__ import annotations

import re
from pathlib import Path

from sgm.messages import needed_to, shorten

PREFIX = "hf://"
# owner/name, a revision behind "@", a folder of the repository behind it.
_SOURCE = re.compile(r"hf://([\w.-]+/[\w.-]+)(?:@([\w./-]+?))?(?:#([\w./-]+))?")
# What an exported folder holds (`python -m nep.export`); nothing else is fetched.
_FILES = ("config.json", "*.safetensors", "*.onnx", "MODEL_CARD.md", "README.md")


def fetch(source: str) -> Path:
    """Return the folder of an exported network, from the cache or else from the hub.

    Args:
        source: "hf://owner/name"; "hf://owner/name@revision"; "hf://owner/name#folder" for an
            exported folder within the repository.

    Raises:
        ModuleNotFoundError: if huggingface_hub is not installed.
        ValueError: if it names no repository, or that cannot be fetched.
    """
    found = _SOURCE.fullmatch(source)
    if found is None or any(part == ".." for part in re.split("[/#]", source)):
        raise ValueError(
            f"network of a hub must be hf://owner/name, got {shorten(source)}. A revision may "
            "follow behind @, and a folder of the repository behind #."
        )
    with needed_to(f"load {shorten(source)}", extra="hub"):
        from huggingface_hub import snapshot_download
        from huggingface_hub.errors import (
            HfHubHTTPError,
            HFValidationError,
            LocalEntryNotFoundError,
        )
    repository, revision, folder = found.groups()
    inner = f"{folder.strip('/')}/" if folder else ""
    try:
        path = snapshot_download(
            repository,
            revision=revision,
            allow_patterns=[f"{inner}{name}" for name in _FILES],
            library_name="scene-graph-memory",
        )
    except (HfHubHTTPError, HFValidationError, LocalEntryNotFoundError, OSError) as error:
        lines = str(error).strip().splitlines() or [type(error).__name__]
        raise ValueError(
            f"network must be one that can be fetched, got {shorten(lines[0], 120)} for "
            f"{shorten(source)}. Check the name and the network, or give a folder."
        ) from None
    return Path(path) / inner
