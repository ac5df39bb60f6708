"""Trained networks on disk: checkpoints of `nep.fit`, exported folders, and what is shipped."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.torch import load as load_tensors
from safetensors.torch import save as save_tensors

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import (
    EDGE_FEATURE_DIM,
    FEATURE_SCHEMA_VERSION,
    NODE_FEATURE_DIM,
    TEXT_DIM,
    FeatureConfig,
)
from nep.any_home.onnx_export import is_exportable, make_onnx
from nep.players.stored_network import (
    build_network,
    check_weights,
    read_features,
)
from nep.tensor_file import read_tensors
from nep.training.training_module import TrainingModule
from sgm.files import (
    VERSION,
    check_version,
    compute_checksum,
    find_target,
    make_read_error,
    read_file,
    read_json,
    write_whole,
)
from sgm.messages import shorten
from sgm.network.network import ONNX, describe_onnx
from sgm.network.shipped import CONFIG, NEW, find_part, find_trained
from sgm.schema import EDGE_TYPES, NODE_TYPES, QUERY_EDGE_TYPES

FORMAT = "node edge predictor"
WEIGHTS = "weights.safetensors"
_Errors = tuple[type[Exception], ...]
_DAMAGED: _Errors = (
    LookupError,
    TypeError,
    AttributeError,
    RuntimeError,
    ArithmeticError,
    SafetensorError,
)
_READ = "checkpoint must be a file that can be read"
_MADE = "checkpoint must be one that nep.fit wrote"
_EXPORT = "Export again with `python -m nep.export`."


@dataclass(frozen=True, slots=True)
class TrainedModel:
    """A network, and what it needs to be asked.

    Attributes:
        module: the network.
        builder: makes its batches, with the features that it was trained on.
        training: what a checkpoint was trained on, as JSON values: `homes`, `steps`, `task`,
            `policy` and `seed` of the collection, whether its homes were recorded (`is_recorded`),
            and how many `snapshots` of it, None for all; None for an exported folder, whose notes
            have it.
    """

    module: TrainingModule
    builder: BatchBuilder
    training: dict[str, Any] | None = None


def load_trained(source: str | Path) -> TrainedModel:
    """Load a trained network; nothing in the files is executed.

    Args:
        source: "any_home" or "heat", the networks that ship with the package; a folder that
            `python -m nep.export` wrote; or a checkpoint of `python -m nep.fit`. A folder of
            one's own that is called like a shipped network is reached as "./heat".

    Raises:
        ValueError: if there is no such file, it is damaged, or it was trained with another feature
            schema or other text vectors than those installed.
    """
    path = find_trained(source)
    return load_exported(path) if path.is_dir() else load_checkpoint(path)


def checksum_trained(source: str | Path) -> str:
    """Return the SHA-256 of a checkpoint, or of an exported folder.

    Of an exported folder count weights, schema, features and model: its logits follow from them.

    Raises:
        ValueError: if there is no such file, or it is damaged.
    """
    path = find_trained(source)
    if not path.is_dir():
        return compute_checksum(path)
    config = load_config(path)
    counts = {name: config.get(name) for name in ("schema", "features", "model")}
    parts = [compute_checksum(find_weights(path, config)), json.dumps(counts, sort_keys=True)]
    return hashlib.sha256("".join(parts).encode()).hexdigest()


def load_checkpoint(path: Path) -> TrainedModel:
    """Load a checkpoint that `python -m nep.fit` wrote; nothing that it names is imported.

    Raises:
        ValueError: if it cannot be read, is no such checkpoint, or does not fit this package.
    """
    advice = "Train one with `python -m nep.fit`, or check the path."
    with _name_faults(_READ, advice, _MADE, "Train again, or check the path.", f"for {path}"):
        content = _load_content(path)
        data = content["datamodule_hyper_parameters"]
        check_feature_schema(data["feature_schema"], path)
        features = read_features(data["features"])
        module = build_network(content["hyper_parameters"], content["state_dict"], path)
        text, training = data["text"], {**data["training"]}
    builder = _make_builder(features, module, text, path)
    return TrainedModel(module, builder, training=training)


def check_resumable(
    path: Path, module: TrainingModule, data: Mapping[str, Any] | None = None
) -> None:
    """Check that a training of a network can go on from a checkpoint, as it is asked for.

    Optimiser, schedule, random numbers and the order of batches come from the checkpoint, and its
    weights fit one network and its features: settings of these must be those of the checkpoint.

    Args:
        path: of the checkpoint.
        module: what is to be trained.
        data: hyper-parameters of the data module; None where none are known.

    Raises:
        ValueError: if it cannot be read, is no such checkpoint, or one of another network, or if a
            setting differs that would not be taken over, or would change what the weights mean.
    """
    advice = "Check --ckpt_path, or leave it out."
    with _name_faults(_READ, advice, _MADE, advice, f"for {path}"):
        content = _load_content(path)
        weights = content["state_dict"]
        for part in ("loops", "optimizer_states", "lr_schedulers", "epoch", "global_step"):
            content[part]
        wanted = {name: tensor.shape for name, tensor in module.state_dict().items()}
        check_weights(weights, wanted, path)
        _check_kept("model", content["hyper_parameters"], dict(module.hparams), path)
        if data is not None:
            kept = content["datamodule_hyper_parameters"]
            for name in ("feature_schema", "text"):
                _check_kept("data", {name: kept[name]}, {name: data[name]}, path)
            _check_kept("data.features", kept["features"], data["features"], path)
            _check_kept("data.seed", kept["training"]["seed"], data["training"]["seed"], path)
            states = content["callbacks"].get("RandomStates", {})
            if "seed" in states and "seed_everything" in data:
                _check_kept("seed_everything", states["seed"], data["seed_everything"], path)


# Settings of a model that a training takes over from its command line whenever it goes on.
_FREE = ("model.listwise_weight", "model.attention.dropout", "model.clock_dropout")


def _check_kept(group: str, kept: Any, asked: Any, path: Path) -> None:
    """Raise ValueError where a setting is not that of a checkpoint, by its name."""
    if group in _FREE or group.rpartition(".")[2] == "_instantiator":
        return
    if isinstance(kept, Mapping) and isinstance(asked, Mapping):
        for name in dict.fromkeys((*kept, *asked)):
            _check_kept(f"{group}.{name}", kept.get(name), asked.get(name), path)
    elif _list(kept) != _list(asked):
        raise ValueError(
            f"{group} must be that of the checkpoint, {shorten(kept)}, got {shorten(asked)} for "
            f"{path}. A training that goes on keeps it: leave it out, or begin anew without "
            "--ckpt_path."
        )


def _list(value: Any) -> Any:
    """Return a sequence as files have it."""
    return list(value) if isinstance(value, (list, tuple)) else value


def save_exported(folder: Path, model: TrainedModel, notes: dict[str, Any]) -> None:
    """Write weights (safetensors) and config with feature schema (JSON), each whole or not.

    A network that reads evidence alone is written as ONNX, too. The config names the checksums of
    both, so that other weights are not taken for them.

    Notes are JSON values about it, which `load_exported` does not read.
    """
    folder.mkdir(parents=True, exist_ok=True)
    hyperparameters = dict(model.module.hparams)
    hyperparameters.pop("_instantiator", None)
    tensors = {name: tensor.contiguous() for name, tensor in model.module.state_dict().items()}
    weights = save_tensors(tensors)
    config: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "weights_sha256": hashlib.sha256(weights).hexdigest(),
        "schema": make_schema(model.builder),
        "features": asdict(model.builder.config),
        "model": hyperparameters,
        "notes": notes,
    }
    _finish_export(folder)
    for name in (WEIGHTS, CONFIG, ONNX):
        find_target(folder / name)  # refuses what is no file
    # Weights are written first; the config that names their checksum comes second, and renaming
    # them last, so that a folder is usable whenever an export over an older one is stopped.
    write_whole(folder / f"{WEIGHTS}{NEW}", weights)
    if is_exportable(model.module, model.builder.config):
        content = make_onnx(model.module, model.builder.config)
        config["onnx"] = describe_onnx(content)
        write_whole(folder / f"{ONNX}{NEW}", content)
    write_whole(folder / CONFIG, (json.dumps(config, indent=1) + "\n").encode())
    _finish_export(folder)


def load_exported(folder: Path) -> TrainedModel:
    """Load a folder that `python -m nep.export` wrote; its logits are those of the checkpoint.

    Raises:
        ValueError: if a file is missing or damaged, or was made for another feature schema, other
            text vectors or by another version of the package.
    """
    config = load_config(folder)
    exists, whole = (
        f"exported folder must have {WEIGHTS}",
        "exported folder must be one that nep.export wrote",
    )
    with _name_faults(exists, _EXPORT, whole, _EXPORT, f"in {folder}"):
        features = read_features(config["features"])
        weights = read_file(find_weights(folder, config))
        tensors = load_tensors(weights)
        checksum = hashlib.sha256(weights).hexdigest()
        if config["weights_sha256"] != checksum:
            raise ValueError(
                f"{WEIGHTS} must be those of {CONFIG}, got others in {folder}: the export was "
                "interrupted, or files of two were mixed. Export again."
            )
        module = build_network(config["model"], tensors, folder)
        text = config["schema"]["text"]
    builder = _make_builder(features, module, text, folder)
    return TrainedModel(module.eval(), builder)


def find_weights(folder: Path, config: dict[str, Any]) -> Path:
    """Return the weights that a config names: new ones, if an export was stopped after it.

    Raises:
        OSError: if new ones cannot be read.
    """
    return find_part(folder, WEIGHTS, config["weights_sha256"])


def _finish_export(folder: Path) -> None:
    """Let new files that the config names take the place of the old ones."""
    try:
        config = read_json(folder / CONFIG, allow_nan=True)
        onnx = config.get("onnx")
        weights = find_weights(folder, config)
        network = find_part(folder, ONNX, onnx["sha256"]) if onnx else None
    except (OSError, ValueError, AttributeError, LookupError, TypeError):
        return  # no folder of an export, or a damaged one
    if weights != folder / WEIGHTS:
        weights.replace(find_target(folder / WEIGHTS))
    if network is None:  # of another network that was exported here
        (folder / ONNX).unlink(missing_ok=True)
    elif network != folder / ONNX:
        network.replace(find_target(folder / ONNX))


def load_config(folder: Path) -> dict[str, Any]:
    """Read the config of an exported folder and check that this package can use it.

    Raises:
        ValueError: if it is missing or damaged, or made for another feature schema.
    """
    exists, whole = (
        f"exported folder must have {CONFIG}",
        f"{CONFIG} must be as nep.export wrote it",
    )
    advice = f"{_EXPORT[:-1]}, or check the path."
    with _name_faults(exists, advice, whole, _EXPORT, f"in {folder}", (*_DAMAGED, ValueError)):
        config = read_json(folder / CONFIG, allow_nan=True)
        version, schema = config["version"], dict(config["schema"])
        config["weights_sha256"]
        if config["format"] != FORMAT:
            raise ValueError(f"format {shorten(config['format'])}")
    check_version("exported folder's", version, folder)
    check_feature_schema(schema.get("feature_schema"), folder)
    for name, expected in make_schema().items():
        if schema.get(name) != expected:
            raise ValueError(
                f"{name} of the exported schema must be {expected}, got "
                f"{shorten(schema.get(name))} in {folder}. Train and export again, or "
                "install the package that exported it."
            )
    return config


def make_schema(builder: BatchBuilder | None = None) -> dict[str, Any]:
    """Return what a network takes for granted about its input, as JSON values.

    Without a builder its text vectors are not named.
    """
    text = {} if builder is None else {"text": builder.text_name}
    return {
        "feature_schema": FEATURE_SCHEMA_VERSION,
        "node_types": list(NODE_TYPES),
        "edge_types": [list(etype) for etype in EDGE_TYPES],
        "query_edge_types": [list(etype) for etype in QUERY_EDGE_TYPES],
        "text_dim": TEXT_DIM,
        "node_temporal_dim": NODE_FEATURE_DIM,
        "edge_feature_dim": EDGE_FEATURE_DIM,
        **text,
    }


def check_feature_schema(version: object, where: str | Path) -> None:
    """Check that a network reads the features that this package makes.

    Raises:
        ValueError: if its feature schema is another one.
    """
    if version != FEATURE_SCHEMA_VERSION:
        raise ValueError(
            f"checkpoint must have feature schema {FEATURE_SCHEMA_VERSION}, got {shorten(version)} "
            f"for {where}. Train again, or install the version of the package that trained it."
        )


@contextmanager
def _name_faults(
    exists: str, find: str, whole: str, mend: str, where: str, damaged: _Errors = _DAMAGED
) -> Iterator[None]:
    """Say which rule a file breaks, that it is `exists` or `whole`, and what to do."""
    try:
        yield
    except OSError as error:
        raise make_read_error(error, exists, f"{where}. {find}") from error
    except damaged as error:
        raise ValueError(f"{whole}, got {type(error).__name__} {where}. {mend}") from error


def _load_content(path: Path) -> Any:
    """Read tensors and plain data."""
    try:
        return read_tensors(path)
    except ValueError as error:
        raise ValueError(
            f"{_MADE}, got {error} for {path}. Train again, or check the path."
        ) from error


def _make_builder(
    features: FeatureConfig, module: TrainingModule, text: str, where: Path
) -> BatchBuilder:
    builder = BatchBuilder(features, module.num_hops)
    if builder.text_name != text:
        raise ValueError(
            f"text vectors must be {shorten(text)}, got {builder.text_name} for {where}. "
            "Install the version of the package that trained it, or train again."
        )
    return builder
