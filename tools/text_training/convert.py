"""A pipeline of spaCy as the one file that `sgm.text` reads without spaCy."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from safetensors.numpy import save

from sgm.messages import shorten
from sgm.text.tok2vec import ATTRIBUTES, METADATA, Tok2Vec, scale_mean
from sgm.text.tokenizer import Tokenizer
from sgm.text.vectors import SpacyEncoder

if TYPE_CHECKING:
    from spacy.language import Language

# Largest difference of an entry of a vector. Entries go up to 2, and float32 makes some 2e-6.
TOLERANCE = 1e-5


def convert(nlp: Language, words: Sequence[str]) -> bytes:
    """Give the content of the file: weights, rules of the tokenizer, and vectors of words.

    The vectors are those that spaCy computes here. So those of words are equal to the bit wherever
    the file is read.

    Args:
        nlp: a pipeline that `tools.text_training` made.
        words: in lower case.

    Raises:
        ValueError: if the pipeline has other layers or rules, so that vectors would differ.
    """
    # Here, as spaCy imports torch where torch is installed.
    from spacy.symbols import IDS  # type: ignore[import-not-found]

    theirs = SpacyEncoder(nlp)
    vectors = np.stack(list(theirs.encode(words)))  # (W, 96)
    arrays, seeds = _collect_weights(nlp)
    arrays["vectors"] = vectors
    rules = _collect_rules(nlp.tokenizer)
    tokenizer = Tokenizer(**rules)
    ours = Tok2Vec(theirs.name, arrays, words=words, seeds=seeds, symbols=IDS, tokenizer=tokenizer)
    for word, vector in zip(words, vectors, strict=True):
        difference = np.max(np.abs(scale_mean(ours.compute_tokens(word)) - vector))
        if difference > TOLERANCE:
            raise ValueError(
                f"vector must be spaCy's to {TOLERANCE}, got a difference of {difference:.1g} for "
                f"{shorten(word)}. Convert pipelines of tools.text_training alone"
            )
    about = {
        "name": theirs.name,
        "words": list(words),
        "seeds": seeds,
        "symbols": IDS,
        "tokenizer": rules,
    }
    # One entry, as several would stand in any order: equal pipelines give equal bytes.
    return save(arrays, metadata={METADATA: json.dumps(about)})


def _collect_weights(nlp: Language) -> tuple[dict[str, np.ndarray], dict[str, int]]:
    model: Any = nlp.get_pipe("tok2vec").model  # type: ignore[attr-defined]
    nodes: dict[str, list[Any]] = {}
    for node in model.walk():
        nodes.setdefault(node.name, []).append(node)
    arrays: dict[str, np.ndarray] = {}
    seeds = {}
    for name, node in zip(ATTRIBUTES, nodes["hashembed"], strict=True):
        arrays[f"table.{name}"] = node.get_param("E")
        seeds[name] = int(node.attrs["seed"])
    for n, (maxout, norm) in enumerate(zip(nodes["maxout"], nodes["layernorm"], strict=True)):
        weights = maxout.get_param("W")  # (96, 3, I), becomes (I, 3 x 96)
        weights = weights.transpose(2, 1, 0).reshape(weights.shape[2], -1)
        arrays[f"layer.{n}.weights"] = np.ascontiguousarray(weights)
        arrays[f"layer.{n}.bias"] = np.ascontiguousarray(maxout.get_param("b").T).reshape(-1)
        arrays[f"layer.{n}.scale"] = norm.get_param("G")
        arrays[f"layer.{n}.shift"] = norm.get_param("b")
    return arrays, seeds


def _collect_rules(tokenizer: Any) -> dict[str, Any]:
    """Collect what texts in lower case can meet."""
    from spacy.lang.norm_exceptions import BASE_NORMS
    from spacy.symbols import NORM, ORTH

    if tokenizer.token_match is not None:
        raise ValueError(
            "tokenizer must have no token_match, got one. Convert pipelines of "
            "tools.text_training alone"
        )
    return {
        "prefix": tokenizer.prefix_search.__self__.pattern,
        "suffix": tokenizer.suffix_search.__self__.pattern,
        "infix": tokenizer.infix_finditer.__self__.pattern,
        "url": tokenizer.url_match.__self__.pattern,
        "special_cases": {
            word: [(part[ORTH], part.get(NORM)) for part in parts]
            for word, parts in sorted(tokenizer.rules.items())
            if word == word.lower() and not word.isspace()
        },
        "norms": {text: norm for text, norm in BASE_NORMS.items() if text == text.lower()},
    }
