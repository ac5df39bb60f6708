"""The 96-d text vector of a label, and which known words a word is like."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sgm.arrays.kept_rows import KeptRows
from sgm.messages import needed_to, shorten
from sgm.text.tok2vec import ENCODER_FILE, RMS, WIDTH, FloatArray, Tok2Vec, load_tok2vec, scale_mean

if TYPE_CHECKING:
    from spacy.language import Language

PAPER_PIPELINE = "en_core_web_sm"
SHIPPED_PIPELINE = Path(__file__).parent / "pipeline"
# Of the weights of words around the most alike one. Chosen on the shipped prior alone: each
# object type left out and predicted from the others (cross-entropy 1.95 nats, 2.88 without words).
WORD_WIDTH = 0.05
_MOST_VECTORS = 20_000  # of labels that are kept: 11 MB
_MOST_WORDS = 500  # whose cosines to the words of a prior are kept: 2 MB
# Parts of a pipeline that no vector needs.
_UNUSED = ["tagger", "morphologizer", "parser", "senter", "ner", "attribute_ruler", "lemmatizer"]


class TextVectors:
    """Text vectors of labels ("salt shaker"): spaCy Tok2Vec, mean over the tokens of the label.

    Every vector is scaled to a root mean square of `RMS`, so that its entries lie mostly within
    [-1, 1] and no label is louder than another; cosines do not change by this. Labels are read in
    lower case, "_" as a space. The vector of a label depends on no other label.

    Args:
        pipeline: None for the pipeline that ships with this package; "en_core_web_sm" for the one
            of the paper, which the user must have installed; or the folder of a pipeline that
            `python -m tools.text_training` wrote.

    Raises:
        ModuleNotFoundError: if `pipeline` is neither a folder nor an installed spaCy package, or
            needs spaCy, which the shipped one does not, and spaCy is not installed.
        ValueError: if the pipeline has no tok2vec component of width 96, or its file is damaged.

    Source: paper section 4.2, appendix B. Differs: the default pipeline is ours (docs/text.md);
    vectors are scaled, since a Tok2Vec does not have the range of 0 to 1 that the paper gives.
    """

    WIDTH = WIDTH
    RMS = RMS

    def __init__(self, pipeline: str | Path | None = None) -> None:
        pipeline = SHIPPED_PIPELINE if pipeline is None else pipeline
        file = Path(pipeline) / ENCODER_FILE
        needs_spacy = pipeline == PAPER_PIPELINE or not file.is_file()
        self._encoder: SpacyEncoder | Tok2Vec = (
            SpacyEncoder(load_language(pipeline)) if needs_spacy else load_tok2vec(file)
        )
        self._vectors = KeptRows[str](_MOST_VECTORS)

    @property
    def name(self) -> str:
        """Language, name and version of the pipeline, such as "en_household-1.0.0"."""
        return self._encoder.name

    @property
    def words(self) -> tuple[str, ...]:
        """Words and phrases in lower case that were trained on; none of a pipeline of spaCy."""
        return self._encoder.words

    def vectors(self, labels: Sequence[str]) -> FloatArray:
        """Give the vector of each label, float32 (L, 96); labels seen before come from a cache.

        Raises:
            TypeError: if `labels` is a single string.
            ValueError: if a label is empty or has a code point that is no character.
        """
        if isinstance(labels, str):
            raise TypeError(
                f"labels must be a sequence of strings, got {shorten(labels)}. Pass "
                f"[{shorten(labels)}]"
            )
        if not labels:
            return np.zeros((0, self.WIDTH), dtype=np.float32)
        return np.stack(self._vectors.take(labels, self._encode))

    def _encode(self, new: Sequence[str]) -> Sequence[FloatArray]:
        """Compute the vectors of labels that are not kept."""
        texts = [" ".join(label.lower().replace("_", " ").split()) for label in new]
        for label, text in zip(new, texts, strict=True):
            if not text:
                raise ValueError(
                    f"label must contain a word, got {shorten(label)}. Give every node type a name"
                )
            if any("\ud800" <= char <= "\udfff" for char in text):
                raise ValueError(
                    f"label must be text that UTF-8 can hold, got {shorten(label)}. Decode it from "
                    "the encoding that it has"
                )
        return list(self._encoder.encode(texts))

    def cosines(self, labels: Sequence[str]) -> FloatArray:
        """Give the cosine of every pair of labels, float32 (L, L), within [-1, 1].

        Computed in float64, so that a cosine does not depend on the labels beside it.
        """
        unit = self.vectors(labels).astype(float) / (self.RMS * self.WIDTH**0.5)  # (L, 96)
        return np.clip(unit @ unit.T, -1.0, 1.0).astype(np.float32)


_LOADED: dict[str | None, TextVectors] = {}


def load_text(pipeline: str | None = None) -> TextVectors:
    """Load text vectors, once per process.

    A network that was trained with a pipeline of one's own can be loaded from then on.
    """
    if pipeline not in _LOADED:
        _LOADED[pipeline] = TextVectors(pipeline)
    return _LOADED[pipeline]


def is_text_known(pipeline: object) -> bool:
    """Tell whether a file may name a pipeline: ours, the paper's, or one that is loaded already."""
    return pipeline in (None, PAPER_PIPELINE) or (isinstance(pipeline, str) and pipeline in _LOADED)


class Alike:
    """Cosines between any words and a list of known ones, (K,)."""

    def __init__(self, known: Sequence[str]) -> None:
        self._known = list(known)
        self._cosines = KeptRows[str](_MOST_WORDS)

    def cosines(self, words: Sequence[str]) -> np.ndarray:
        """Return the cosine of each word to each known one, float64 (n, K), -1 to itself."""
        return np.array(self._cosines.take(words, self._compare)).reshape(-1, len(self._known))

    def _compare(self, words: Sequence[str]) -> np.ndarray:
        found = compare(words, self._known)
        for word, cosines in zip(words, found, strict=True):
            cosines[[known == word for known in self._known]] = -1
        return found


def weigh(cosines: np.ndarray, is_present: np.ndarray | bool = True) -> np.ndarray:
    """Return weights of known words from cosines, (n, K) -> (n, K), a sum of one in each row.

    exp(cosine / `WORD_WIDTH`), normalised over those present; zeros where none is.
    """
    cosines = np.where(is_present, cosines, -np.inf)
    most = cosines.max(axis=1, keepdims=True, initial=-1)
    weights = np.exp((cosines - most) / WORD_WIDTH)
    total = weights.sum(axis=1, keepdims=True)
    return np.divide(weights, total, out=np.zeros_like(weights), where=total > 0)


def compare(words: Sequence[str], others: Sequence[str]) -> np.ndarray:
    """Return the cosine of each word to each of others, float64 (n, m).

    Products are added up in one order whatever n and m are, so that no word's depends on another.
    """
    return np.einsum("nd,md->nm", _compute_units(words), _take_others(tuple(others)))


def _compute_units(words: Sequence[str]) -> np.ndarray:
    """Return vectors of length one, float64 (n, 96)."""
    vectors = load_text().vectors(words).astype(float)
    return vectors / np.sqrt((vectors**2).sum(axis=1, keepdims=True))


@lru_cache(maxsize=4)  # a memory is asked again and again, and seldom learns a word
def _take_others(words: tuple[str, ...]) -> np.ndarray:
    return _compute_units(words)


class SpacyEncoder:
    """Tokenizer and tok2vec of a pipeline, nothing else of it.

    Raises:
        ValueError: if it has no tok2vec component of width 96.
    """

    def __init__(self, nlp: Language) -> None:
        has_tok2vec = "tok2vec" in nlp.pipe_names
        found = nlp.get_pipe("tok2vec").model.get_dim("nO") if has_tok2vec else None  # type: ignore[attr-defined]
        if found != WIDTH:
            raise ValueError(
                f"text pipeline must have a tok2vec component of width {WIDTH}, got {found} in "
                f"{shorten(nlp.meta['name'])}. Use en_core_web_sm or the shipped pipeline"
            )
        self._nlp = nlp

    @property
    def name(self) -> str:
        """Language, name and version."""
        meta = self._nlp.meta
        return f"{meta['lang']}_{meta['name']}-{meta['version']}"

    @property
    def words(self) -> tuple[str, ...]:
        """None: they are not listed apart."""
        return ()

    def encode(self, texts: Sequence[str]) -> Iterator[FloatArray]:
        """Give the vector of each text, float32 (96,)."""
        for doc in self._nlp.pipe(texts):
            yield scale_mean(doc.tensor)


def load_language(pipeline: str | Path) -> Language:
    """Load a pipeline of spaCy; the name of the paper's is never that of a folder.

    Raises:
        ModuleNotFoundError: if spaCy or the package is not installed.
    """
    use = f"load the text pipeline {shorten(str(pipeline))} (the one that ships does without)"
    with needed_to(use, install="'spacy>=3.8,<4'"):
        import spacy  # here, not above: it imports torch where torch is installed, seconds
    is_folder = pipeline != PAPER_PIPELINE and (Path(pipeline) / "config.cfg").is_file()
    if not is_folder and not spacy.util.is_package(str(pipeline)):
        raise ModuleNotFoundError(
            "text pipeline must be an installed package or a folder with config.cfg, got "
            f"{shorten(str(pipeline))}. Run `python -m spacy download {pipeline}`, or leave it out "
            "to use the shipped pipeline"
        )
    return spacy.load(pipeline, exclude=_UNUSED)
