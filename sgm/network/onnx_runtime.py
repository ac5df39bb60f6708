"""The one place that imports ONNX Runtime: it sends nothing to its vendor, and keeps no id."""

from __future__ import annotations

import os
from typing import Any

TELEMETRY = "ORT_DISABLE_TELEMETRY"  # "1" switches it off, if set before the import


def import_onnx_runtime() -> Any:
    """Return the module `onnxruntime`, its telemetry switched off.

    From version 1.29 on it reports models and devices to its vendor, and writes a device id and a
    database into the user's cache folder. The variable `ORT_DISABLE_TELEMETRY` prevents all of it
    in a process where it is set before the first import. A value that the user has set stays.
    """
    is_unset = TELEMETRY not in os.environ
    os.environ.setdefault(TELEMETRY, "1")
    import onnxruntime  # here, so that what asks no network does not wait for it

    if is_unset:  # it may be imported already; and Windows has events without the variable
        onnxruntime.disable_telemetry_events()
    return onnxruntime
