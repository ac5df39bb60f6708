"""Temporal graph networks that read the looks of a robot as a stream of events."""

from importlib.util import find_spec

if find_spec("torch_geometric") is None:
    raise ModuleNotFoundError(
        "torch_geometric must be installed for temporal networks, got none. Install the extra: "
        "pip install ./core '.[events]'."
    )
