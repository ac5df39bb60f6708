"""Train the small text pipeline: `python -m tools.text_training --out DIR`.

The tok2vec of en_core_web_sm (hashed norm, prefix, suffix and shape; width 96; four window encoder
layers) learns vectors whose cosines are those of the facets in taxonomy.json. Beside the pipeline
of spaCy its weights and rules are written as one file, which is read without spaCy.
"""

from __future__ import annotations

import json
import logging
import time
from pathlib import Path
from typing import Any

import numpy as np
import spacy
from numpy.typing import NDArray
from spacy.language import Language
from spacy.tokens import Doc
from thinc.api import (
    Adam,
    Model,
    NumpyOps,
    chain,
    fix_random_seed,
    list2ragged,
    reduce_mean,
    set_dropout_rate,
)

from sgm.checks import check_at_least
from sgm.files import write_whole
from sgm.prior.prior_graph import PriorGraph
from sgm.schema import HOME_LABELS
from sgm.text.tok2vec import ENCODER_FILE
from sgm.text.vectors import TextVectors, load_language
from simulator.command_line import make_parser, one_line_errors, parse
from simulator.process import run_main
from tools.text_training.convert import convert

FloatArray = NDArray[np.float32]

logger = logging.getLogger(__name__)

# Its matrix product runs on one thread: numpy's rounds differently for each number of threads.
OPS = NumpyOps()

FOLDER = Path(__file__).parent
VERSION = "1.0.0"
# Squared weights are shares of the cosine of two labels; `identity` is shared by a word and its
# plural alone, so that a fork stays distinct from a spoon.
FACET_WEIGHTS = {
    "name": 1.0,
    "kinds": 0.9,
    "uses": 0.5,
    "rooms": 0.5,
    "places": 0.6,
    "materials": 0.3,
    "identity": 0.6,
}
# Keeps single entries from towering over the rest, which suits the layers that read the vectors.
SPREAD = 3e-4
# Make "mugs" the tokens "mug" and "s", so that the plural of a word is known with the word.
PLURAL_SUFFIXES = [r"(?<=[a-z][a-z][^\Wisu])s", r"(?<=ch|sh|ss|to|ox)es"]
MODEL = {
    "@architectures": "spacy.Tok2Vec.v2",
    "embed": {
        "@architectures": "spacy.MultiHashEmbed.v2",
        "width": TextVectors.WIDTH,
        "attrs": ["NORM", "PREFIX", "SUFFIX", "SHAPE"],
        "rows": [3000, 200, 1500, 100],  # fewer than en_core_web_sm, for a small file
        "include_static_vectors": False,
    },
    "encode": {
        "@architectures": "spacy.MaxoutWindowEncoder.v2",
        "width": TextVectors.WIDTH,
        "depth": 4,
        "window_size": 1,
        "maxout_pieces": 3,
    },
}


def load_taxonomy() -> dict[str, Any]:
    """Load groups of words with their facets."""
    return json.loads((FOLDER / "taxonomy.json").read_text(encoding="utf-8"))


def load_evaluation() -> dict[str, list[list[str]]]:
    """Load the triples (a, near, far) by kind."""
    sections = json.loads((FOLDER / "evaluation.json").read_text(encoding="utf-8"))
    return {section: triples for section, triples in sections.items() if section != "about"}


def list_words() -> list[str]:
    """List the words whose vectors are stored: of the taxonomy and of the shipped priors."""
    words = [word for group in load_taxonomy()["groups"] for word in group["words"]]
    for prior in (PriorGraph.default(), PriorGraph.household()):
        words += [*HOME_LABELS, *prior.rooms]
        words += [furniture.label for furniture in prior.furniture]
        words += [thing.label for thing in prior.objects]
    return list(dict.fromkeys(words))


def compute_plural(phrase: str) -> str:
    """Give the regular English plural of a phrase; a phrase that ends in a single s stays."""
    if phrase.endswith(("ss", "x", "ch", "sh")):
        return phrase + "es"
    if phrase.endswith("s"):
        return phrase
    if phrase.endswith(("tato", "mato")):
        return phrase + "es"
    if phrase.endswith("y") and phrase[-2:-1] not in "aeiou":
        return phrase[:-1] + "ies"
    for singular, plural in (("knife", "knives"), ("shelf", "shelves"), ("loaf", "loaves")):
        if phrase.endswith(singular):
            return phrase.removesuffix(singular) + plural
    return phrase + "s"


def compute_features(
    groups: list[dict[str, Any]], unseen: set[str]
) -> tuple[list[str], FloatArray]:
    """Give the training phrases and their facets; products of facets are the cosines to learn.

    Args:
        groups: of the taxonomy.
        unseen: phrases that must not be trained on (the plurals of the evaluation).

    Returns:
        P phrases (words and their plurals) and float32 (P, facet values), rows of unit length.
    """
    words = list(dict.fromkeys(word for group in groups for word in group["words"]))
    row_of = {word: i for i, word in enumerate(words)}
    blocks = []
    for facet, weight in FACET_WEIGHTS.items():
        if facet == "identity":
            blocks.append(weight * np.eye(len(words)))
            continue
        values = [[group[facet]] if facet == "name" else group[facet] for group in groups]
        column = {v: i for i, v in enumerate(dict.fromkeys(v for vs in values for v in vs))}
        block = np.zeros((len(words), len(column)))
        for group, vs in zip(groups, values, strict=True):
            for word in group["words"]:
                block[row_of[word], [column[v] for v in vs]] += 1.0
        lengths = np.linalg.norm(block, axis=1, keepdims=True)
        blocks.append(weight * block / np.maximum(lengths, 1.0))
    features = np.concatenate(blocks, axis=1)  # (W, facet values)
    features /= np.linalg.norm(features, axis=1, keepdims=True)
    source = {word: row_of[word] for word in words}
    for word in words:
        source.setdefault(compute_plural(word), row_of[word])
    phrases = [phrase for phrase in source if phrase not in unseen]
    rows = [source[phrase] for phrase in phrases]
    return phrases, features[rows].astype(np.float32)


def make_document(
    nlp: Language, phrase: str, modifiers: list[str], *, rng: np.random.Generator
) -> Doc:
    """Tokenize a phrase, sometimes after a modifier, sometimes with a word that hides its norm.

    A hidden norm leaves prefix, suffix and shape, from which an unknown word must be understood.
    """
    if rng.random() < 0.2:
        phrase = f"{modifiers[rng.integers(len(modifiers))]} {phrase}"
    doc = nlp.make_doc(phrase)
    if rng.random() < 0.25:
        doc[int(rng.integers(len(doc)))].norm_ = f"hidden{rng.integers(10_000)}"
    return doc


def compute_loss(vectors: FloatArray, targets: FloatArray) -> tuple[float, FloatArray]:
    """Compute the error of the cosines plus the peakedness of the vectors, and the gradient.

    With u a vector of unit length and k a target: sum over pairs of w (u_i u_j - k_ij)^2, where w
    is proportional to 1 + 10 k because most pairs are unlike. To it comes `SPREAD` times the mean
    over vectors of 96 sum u^4, which is 3 for normally distributed entries and 96 for a one-hot.

    Args:
        vectors: float32 (B, 96).
        targets: float32 (B, B), cosines.

    Returns:
        The loss and its gradient by `vectors`, float32 (B, 96).
    """
    width = vectors.shape[1]
    norms = np.linalg.norm(vectors, axis=1, keepdims=True)  # (B, 1)
    unit = vectors / norms
    error = OPS.gemm(unit, unit, trans2=True) - targets  # (B, B)
    weights = 1.0 + 10.0 * targets
    weights /= weights.sum()
    loss = float(np.sum(weights * error**2)) + SPREAD * width * float(np.sum(unit**4)) / len(unit)
    d_unit = 4.0 * OPS.gemm(weights * error, unit)  # (B, 96); weights and error are symmetric
    d_unit += SPREAD * width * 4.0 / len(unit) * unit**3
    d_vectors = (d_unit - unit * np.sum(d_unit * unit, axis=1, keepdims=True)) / norms
    return loss, d_vectors


def train(
    taxonomy: dict[str, Any],
    unseen: set[str],
    *,
    epochs: int,
    batch_size: int,
    learning_rate: float,
    seed: int,
) -> Language:
    """Train the pipeline from scratch; the same seed gives the same weights.

    Args:
        taxonomy: modifiers ("large", "red") and groups of words with their facets.
        unseen: phrases that must not be trained on.
        epochs: passes over all phrases; the learning rate falls linearly to zero in this time.
        batch_size: phrases per update; the cosines of all their pairs enter the loss.
        learning_rate: of Adam, at the start.
        seed: of the weights, the order of phrases, the modifiers and the hidden norms.
    """
    fix_random_seed(seed)
    rng = np.random.default_rng(seed)
    phrases, features = compute_features(taxonomy["groups"], unseen)
    nlp = spacy.blank("en")
    nlp.meta.update(
        name="household",
        version=VERSION,
        description="96-d vectors of household words, docs/text.md",
        license="Apache-2.0",
        spacy_version=">=3.8.0,<4.0.0",  # as in setup.cfg; others load it with a warning
    )
    suffixes = [*(nlp.Defaults.suffixes or []), *PLURAL_SUFFIXES]
    tokenizer: Any = nlp.tokenizer
    tokenizer.suffix_search = spacy.util.compile_suffix_regex(suffixes).search
    tok2vec: Any = nlp.add_pipe("tok2vec", config={"model": MODEL})
    nlp.initialize()
    model: Model[list[Doc], FloatArray] = chain(tok2vec.model, list2ragged(), reduce_mean())
    model.initialize([nlp.make_doc("mug")])
    set_dropout_rate(model, 0.1)
    optimizer = Adam(learning_rate, L2=1e-3, grad_clip=1.0)
    for epoch in range(epochs):
        optimizer.learn_rate = learning_rate * (1.0 - epoch / epochs)
        order = rng.permutation(len(phrases))
        losses = []
        for start in range(0, len(order), batch_size):
            rows = order[start : start + batch_size]
            docs = [make_document(nlp, phrases[i], taxonomy["modifiers"], rng=rng) for i in rows]
            vectors, backprop = model.begin_update(docs)  # (B, 96)
            targets = OPS.gemm(features[rows], features[rows], trans2=True)  # (B, B)
            loss, gradient = compute_loss(vectors, targets)
            backprop(gradient)
            model.finish_update(optimizer)
            losses.append(loss)
        logger.info("epoch %d of %d: loss %.4f", epoch + 1, epochs, np.mean(losses))
    set_dropout_rate(model, 0.0)
    return nlp


def write_encoder(folder: Path) -> None:
    """Write, for the pipeline in a folder, the file that `TextVectors` reads without spaCy."""
    write_whole(folder / ENCODER_FILE, convert(load_language(folder), list_words()))


def compute_accuracy(text: TextVectors) -> dict[str, float]:
    """Give the share of triples (a, near, far) of each kind whose near word is the nearer one."""
    accuracy = {}
    for section, triples in load_evaluation().items():
        cosines = [text.cosines(triple)[0] for triple in triples]
        accuracy[section] = float(np.mean([near > far for _, near, far in cosines]))
    return accuracy


def main(arguments: list[str] | None = None) -> None:
    """Train, save, and print how many of the evaluation's triples hold."""
    parser = make_parser("python -m tools.text_training", "Train the small text pipeline.")
    parser.add_argument("--out", type=Path, required=True, help="folder for the pipeline")
    parser.add_argument(
        "--convert_only",
        action="store_true",
        help=f"write {ENCODER_FILE} anew for the pipeline in the folder, without training",
    )
    parser.add_argument("--epochs", type=int, default=40)
    parser.add_argument("--batch_size", type=int, default=128)
    parser.add_argument("--learning_rate", type=float, default=5e-3)
    parser.add_argument("--seed", type=int, default=0)
    with one_line_errors(status=2):
        options = parse(parser, arguments)
        check_at_least(1, epochs=options.epochs, batch_size=options.batch_size)
        if options.convert_only:
            write_encoder(options.out)
            return
        options.out.mkdir(parents=True, exist_ok=True)  # before the minutes of training
    logging.basicConfig(format="%(message)s")
    logger.setLevel(logging.INFO)
    start = time.perf_counter()
    evaluation = load_evaluation()
    nlp = train(
        load_taxonomy(),
        {a for section, triples in evaluation.items() if section != "known" for a, _, _ in triples},
        epochs=options.epochs,
        batch_size=options.batch_size,
        learning_rate=options.learning_rate,
        seed=options.seed,
    )
    (options.out / ENCODER_FILE).unlink(missing_ok=True)  # never one of other weights
    nlp.to_disk(options.out, exclude=["vocab"])
    write_encoder(options.out)
    print(
        json.dumps(
            {
                "seconds": round(time.perf_counter() - start, 1),
                "accuracy": compute_accuracy(TextVectors(options.out)),
            }
        )
    )


if __name__ == "__main__":
    run_main(main)
