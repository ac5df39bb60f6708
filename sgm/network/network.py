"""A network in an exported folder: `network.onnx`, and what `config.json` says of it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sgm.evidence.columns import EVIDENCE_VERSION, PLACE_COLUMNS, QUESTION_COLUMNS
from sgm.files import check_version, make_read_error, open_file, parse_json, read_file
from sgm.messages import shorten, shorten_text
from sgm.network.onnx_check import check_onnx
from sgm.network.onnx_runtime import import_onnx_runtime
from sgm.network.shipped import CONFIG, find_part
from sgm.schema import RELATIONS
from sgm.text import load_text

ONNX = "network.onnx"
EDGE_COLUMNS = ("prior", *(f"is_{name}" for name in RELATIONS[1:]))  # else the first relation
OUTPUTS: dict[str, list[int | str]] = {
    "logits": ["questions", "places", 1],
    "elsewhere": ["questions", 1, 1],
}
INPUTS: dict[str, list[int | str]] = {  # axes of each; a text stands for any number
    "place": ["questions", "places", len(PLACE_COLUMNS)],
    "question": ["questions", 1, len(QUESTION_COLUMNS)],
    "edge": ["questions", "places", len(EDGE_COLUMNS)],
    "is_place": ["questions", "places", 1],
}

_MOST_CONFIG_BYTES = 2**24  # of config.json; the one that ships has 21 kB
_MOST_BYTES = 64 * 2**20  # of network.onnx; the one that ships has less than one MB


@dataclass(frozen=True, slots=True)
class Network:
    """A network that reads evidence alone, ready to answer.

    Attributes:
        session: ONNX Runtime's, on the CPU.
        checksum: SHA-256 of network.onnx.
    """

    session: Any
    checksum: str

    @classmethod
    def load(cls, folder: Path, threads: int = 1) -> Network:
        """Load a folder that `python -m nep.export` wrote; nothing in the files is executed.

        Args:
            folder: with config.json and network.onnx.
            threads: of ONNX Runtime; answers are the same for any number of them.

        Raises:
            ValueError: if a file is missing or damaged, or was made for other evidence or text
                vectors than those installed.
        """
        try:
            config = _read_config(folder)
            check_version("exported folder's", config["version"], folder)
            about = config["onnx"]
            text, evidence = config["schema"]["text"], about["evidence"]
            checksum = about["sha256"]
            content = _read_file(find_part(folder, ONNX, checksum))
        except OSError as error:
            rule = f"exported folder must have {CONFIG} and {ONNX}"
            where = f"in {folder}. Export again with `python -m nep.export`."
            raise make_read_error(error, rule, where) from error
        except (KeyError, TypeError, AttributeError) as error:
            raise ValueError(
                f"exported folder must be one that nep.export wrote, got {type(error).__name__} "
                f"in {folder}. Export again with `python -m nep.export`."
            ) from error
        if evidence != EVIDENCE_VERSION:
            raise ValueError(
                f"network must read version {EVIDENCE_VERSION} of the evidence, got "
                f"{shorten(evidence)} in {folder}. Install the version of the package that "
                "exported it, or train again."
            )
        if load_text().name != text:
            raise ValueError(
                f"text vectors must be {shorten(text)}, got {load_text().name} for {folder}. "
                "Install the version of the package that trained it, or train again."
            )
        found = hashlib.sha256(content).hexdigest()
        if found != checksum:
            raise ValueError(
                f"{ONNX} must be that of {CONFIG}, got another in {folder}: the export was "
                "interrupted, or files of two were mixed. Export again."
            )
        return cls(_open(content, threads, folder), found)

    def compute_logits(
        self, place: np.ndarray, question: np.ndarray, edge: np.ndarray, is_place: np.ndarray
    ) -> np.ndarray:
        """Answer questions: logits of the places and of elsewhere, float64 (Q, F + 1).

        What stands where there is no place means nothing.

        Evidence of each place is float32 (Q, F, D), of each question (Q, C), `edge` has
        `EDGE_COLUMNS` of each place, (Q, F, R), and `is_place` is bool (Q, F).
        """
        inputs = {
            "place": place,
            "question": question[:, None],
            "edge": edge,
            "is_place": is_place[..., None].astype(np.float32),
        }
        answers = self.session.run([*OUTPUTS], inputs)
        return np.concatenate(answers, axis=1)[..., 0]


def describe_onnx(content: bytes) -> dict[str, Any]:
    """Return what the config of an exported folder says of its ONNX file, as JSON values."""
    return {"sha256": hashlib.sha256(content).hexdigest(), "evidence": EVIDENCE_VERSION}


def has_onnx(folder: Path) -> bool:
    """Tell whether a folder says that it has a network that ONNX Runtime can run."""
    try:
        return "onnx" in _read_config(folder)
    except (OSError, ValueError, TypeError):  # who reads it says what is wrong
        return (folder / ONNX).is_file()


def _read_config(folder: Path) -> Any:
    content = read_file(folder / CONFIG, _MOST_CONFIG_BYTES)
    try:
        return parse_json(content, allow_nan=True)
    except ValueError as error:
        raise ValueError(
            f"{CONFIG} must be as nep.export wrote it, got {error} in {folder}. Export again with "
            "`python -m nep.export`."
        ) from None


def _read_file(path: Path) -> bytes:
    """Read a file of no more than `_MOST_BYTES`."""
    with open_file(path) as file:
        content = file.read(_MOST_BYTES + 1)
    if len(content) > _MOST_BYTES:
        raise ValueError(
            f"{ONNX} must have at most {_MOST_BYTES} bytes, got more in {path.parent}. "
            "Export again."
        )
    return content


def _open(content: bytes, threads: int, folder: Path) -> Any:
    """Open a session for a network that was checked; `ValueError` if it is no network of ours."""
    onnxruntime = import_onnx_runtime()
    try:
        check_onnx(content)
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = threads
        options.inter_op_num_threads = 1
        options.log_severity_level = 3  # errors are raised; warnings are about speed
        # Waiting threads sleep: spinning ones take a core from the robot.
        options.add_session_config_entry("session.intra_op.allow_spinning", "0")
        session = onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
        found = {given.name: given.shape for given in session.get_inputs()}
        if found != INPUTS or [given.name for given in session.get_outputs()] != [*OUTPUTS]:
            raise ValueError(f"inputs {found}")
    except Exception as error:  # ONNX Runtime's are of many kinds
        raise ValueError(
            f"{ONNX} must be as nep.export wrote it, got {type(error).__name__}: "
            f"{shorten_text(str(error))} in {folder}. Export again with `python -m nep.export`."
        ) from error
    return session
