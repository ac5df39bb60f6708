"""Networks built from what a file says of them, of no more than its weights can fill."""

from __future__ import annotations

import importlib
import inspect
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from datamodules.feature_config import FeatureConfig
from nep.any_home.any_home_module import AnyHomeModule
from nep.paper.encoders import Encoder, load_all
from nep.paper.nep_module import NEPModule
from nep.paper.query_attention import AttentionConfig
from nep.training.training_module import TrainingModule
from sgm.messages import shorten, shorten_text
from sgm.text import PAPER_PIPELINE, is_text_known

# A number of units or layers may be above the axes of the weights only where nothing is sized by
# it, such as the attention's in a network without one.
_UNUSED = 4096


def build_network(
    hyperparameters: Any, weights: Mapping[str, Tensor], where: str | Path
) -> TrainingModule:
    """Build a network and fill it.

    Nothing is allocated before the weights are known to fit: the network is built without memory
    first, and no number in the hyper-parameters may be above what the weights can show.

    Raises:
        ValueError: if they are of the wrong kind, the encoder's class is not loaded, or the
            weights are those of another network.
    """
    arguments: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in hyperparameters.items()
    }
    arguments.pop("_instantiator", None)  # names a function that would import the encoder
    sizes = [max(t.shape, default=0) for t in weights.values() if t.numel()]
    highest = max([_UNUSED, len(weights), *sizes])
    if "encoder" not in arguments:
        _check_arguments(AnyHomeModule, arguments, highest, where)
        build: Callable[[], TrainingModule] = partial(AnyHomeModule, **arguments)
    else:
        build = _prepare_paper(arguments, highest, where)
    try:
        with torch.device("meta"):
            wanted = {name: tensor.shape for name, tensor in build().state_dict().items()}
    except Exception as error:  # an encoder of one's own may raise anything
        raise ValueError(
            f"hyper-parameters must be those of a network, got {type(error).__name__}: "
            f"{shorten_text(str(error))} in {where}. Train again, or export again."
        ) from error
    check_weights(weights, wanted, where)
    module = build()
    module.load_state_dict(dict(weights))
    return module


def _prepare_paper(
    arguments: dict[str, Any], highest: int, where: str | Path
) -> Callable[[], TrainingModule]:
    """Check what a file says of the paper's network; return what builds it."""
    encoder = arguments.pop("encoder")
    is_named = isinstance(encoder, Mapping) and "class_path" in encoder
    given = encoder.get("init_args", {}) if is_named else None
    if not isinstance(given, Mapping):
        raise ValueError(
            f"encoder must have a class_path and init_args by name, got {shorten(encoder)} in "
            f"{where}. Train again, or export again."
        )
    encoder_class = _find_encoder(encoder["class_path"], where)
    encoder_arguments: dict[str, Any] = {  # files have tuples as lists
        name: tuple(value) if isinstance(value, list) else value for name, value in given.items()
    }
    attention = arguments.pop("attention", {})
    for cls, values in (
        (encoder_class, encoder_arguments),
        (AttentionConfig, attention),
        (NEPModule, arguments),
    ):
        _check_arguments(cls, values, highest, where)

    def build() -> TrainingModule:
        made = AttentionConfig(**attention)
        return NEPModule(encoder_class(**encoder_arguments), attention=made, **arguments)

    return build


def read_features(data: Any) -> FeatureConfig:
    """Read the features that a network was trained with.

    Raises:
        TypeError: if they are of the wrong kind.
        ValueError: if they name text vectors that neither we nor the caller have named.
    """
    lists = {name: tuple(value) for name, value in data.items() if isinstance(value, list)}
    config = FeatureConfig(**{**data, **lists})
    for field in fields(FeatureConfig):
        value = getattr(config, field.name)
        if not _is_like(value, field.default):
            raise TypeError(f"{field.name} of the features is {shorten(value)}")
    if not is_text_known(config.text_pipeline):
        raise ValueError(
            f"text_pipeline of a file must be '{PAPER_PIPELINE}', none or one that is loaded, got "
            f"{shorten(config.text_pipeline)}. Load it before: `sgm.text.load_text(...)`, "
            "in a module that --encoders names, for example."
        )
    return config


def import_encoders(modules: Sequence[str]) -> None:
    """Import modules that define encoders, so that networks made of them can be loaded.

    A checkpoint or an exported folder never makes us import what it names.

    Raises:
        ValueError: if there is no such module.
    """
    for name in modules:
        try:
            importlib.import_module(name)
        except (ImportError, TypeError, ValueError) as error:  # the last two of ".." or ""
            raise ValueError(
                f"encoders must be modules that can be imported, got {shorten(name)} ({error}). "
                "Put their folder on PYTHONPATH."
            ) from error


def _find_encoder(class_path: Any, where: str | Path) -> type[Encoder]:
    """Find an encoder class among those that are loaded; a file never makes us import one."""
    load_all()
    found: dict[Any, type[Encoder]] = {}
    to_visit = Encoder.__subclasses__()
    while to_visit:
        cls = to_visit.pop()
        found[f"{cls.__module__}.{cls.__qualname__}"] = cls
        to_visit += cls.__subclasses__()
    if class_path not in found:
        raise ValueError(
            f"encoder must be one of {', '.join(sorted(found))}, got {shorten(class_path)} in "
            f"{where}. Import your own encoder's module first; on a command line, name it by "
            "--encoders."
        )
    return found[class_path]


def _check_arguments(
    function: Callable[..., Any], values: Any, highest: int, where: str | Path
) -> None:
    """Check that arguments are like the defaults, and that none sizes more than there is."""
    if not isinstance(values, Mapping):
        raise TypeError("arguments are no JSON object")
    defaults = inspect.signature(function).parameters
    for name, value in values.items():
        default = defaults[name].default if name in defaults else inspect.Parameter.empty
        if default is not inspect.Parameter.empty and not _is_like(value, default):
            raise ValueError(
                f"hyper-parameter {name} must be a value like {shorten(default)}, got "
                f"{shorten(value)} in {where}. Train again, or export again."
            )
        numbers = value if type(value) is tuple else (value,)
        if any(type(each) is int and abs(each) > highest for each in numbers):
            raise ValueError(
                f"hyper-parameter {name} must be at most {highest}, as large as the weights, got "
                f"{shorten(value)} in {where}. Train again, or export again."
            )


def _is_like(value: Any, default: Any) -> bool:
    """Tell whether a value is of the kind of a default; one that is None says nothing."""
    if type(default) is float:
        return type(value) in (int, float) and abs(value) <= sys.float_info.max
    if type(default) is tuple and default and type(value) is tuple:
        return len(value) == len(default) and all(map(_is_like, value, default))
    return not isinstance(default, (bool, int, str, tuple)) or type(value) is type(default)


def check_weights(
    weights: Mapping[str, Tensor], wanted: Mapping[str, torch.Size], where: str | Path
) -> None:
    """Check that weights are those of a network.

    Raises:
        ValueError: if one is missing, unknown, of another shape, or not finite everywhere.
    """
    problem = ""
    if missing := sorted(wanted.keys() - weights.keys()):
        problem = f"none called {missing[0]}"
    elif unknown := sorted(weights.keys() - wanted.keys()):
        problem = f"{shorten(unknown[0])}, which it does not have"
    else:
        for name, shape in wanted.items():
            if weights[name].shape != shape:
                found = tuple(weights[name].shape)
                problem = f"{name} of shape {found} instead of {tuple(shape)}"
            elif weights[name].is_complex() or not weights[name].isfinite().all():
                problem = f"{name} that is not finite everywhere"
    if problem:
        raise ValueError(
            f"weights must be those of the network, got {problem} in {where}. Train again, or "
            "export again."
        )
