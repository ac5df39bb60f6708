"""The 96-d text vector of a label."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sgm.messages import shorten

if TYPE_CHECKING:
    from spacy.language import Language

FloatArray = NDArray[np.float32]

PAPER_PIPELINE = "en_core_web_sm"
SHIPPED_PIPELINE = Path(__file__).parent / "pipeline"


class TextVectors:
    """Text vectors of labels ("salt shaker"): spaCy Tok2Vec, mean over the tokens of the label.

    Every vector is scaled to a root mean square of `RMS`, so that its entries lie mostly within
    [-1, 1] and no label is louder than another; cosines do not change by this. Labels are read in
    lower case, "_" as a space. The vector of a label depends on nothing but the label.

    Args:
        pipeline: None for the pipeline that ships with this package; "en_core_web_sm" for the one
            of the paper, which the user must have installed; or the folder of a pipeline that
            `python -m simulator.text.train` wrote.

    Raises:
        ModuleNotFoundError: if `pipeline` is neither a folder nor an installed spaCy package.
        ValueError: if the pipeline has no tok2vec component of width 96.

    Source: paper section 4.2, appendix B. Differs: the default pipeline is ours (docs/text.md);
    vectors are scaled, since a Tok2Vec does not have the range of 0 to 1 that the paper gives.
    """

    WIDTH = 96
    RMS = 0.5

    def __init__(self, pipeline: str | Path | None = None) -> None:
        self._nlp = _load_pipeline(SHIPPED_PIPELINE if pipeline is None else pipeline)
        _check_width(self._nlp, self.WIDTH)
        self._vector_of: dict[str, FloatArray] = {}

    @property
    def name(self) -> str:
        """Language, name and version of the pipeline, such as "en_household-1.0.0"."""
        meta = self._nlp.meta
        return f"{meta['lang']}_{meta['name']}-{meta['version']}"

    def vectors(self, labels: Sequence[str]) -> FloatArray:
        """Give the vector of each label, float32 (L, 96); labels seen before come from a cache.

        Raises:
            TypeError: if `labels` is a single string.
            ValueError: if a label is empty.
        """
        if isinstance(labels, str):
            raise TypeError(
                f"labels must be a sequence of strings, got {shorten(labels)}. Pass "
                f"[{shorten(labels)}]"
            )
        new = [label for label in dict.fromkeys(labels) if label not in self._vector_of]
        self._vector_of.update(zip(new, self._compute_vectors(new), strict=True))
        if not labels:
            return np.zeros((0, self.WIDTH), dtype=np.float32)
        return np.stack([self._vector_of[label] for label in labels])

    def cosines(self, labels: Sequence[str]) -> FloatArray:
        """Give the cosine of every pair of labels, float32 (L, L), within [-1, 1].

        Computed in float64, so that a cosine does not depend on the labels beside it.
        """
        unit = self.vectors(labels).astype(float) / (self.RMS * self.WIDTH**0.5)  # (L, 96)
        return np.clip(unit @ unit.T, -1.0, 1.0).astype(np.float32)

    def _compute_vectors(self, labels: Sequence[str]) -> Iterator[FloatArray]:
        texts = [" ".join(label.lower().replace("_", " ").split()) for label in labels]
        for label, text in zip(labels, texts, strict=True):
            if not text:
                raise ValueError(
                    f"label must contain a word, got {shorten(label)}. Give every node type a name"
                )
        for doc in self._nlp.pipe(texts):
            mean = doc.tensor.mean(axis=0)  # (96,)
            scale = self.RMS / max(float(np.sqrt(np.mean(mean**2))), 1e-8)
            yield (mean * scale).astype(np.float32)


_LOADED: dict[str | None, TextVectors] = {}


def load_text(pipeline: str | None = None) -> TextVectors:
    """Load text vectors, once per process: it takes a quarter of a second.

    A network that was trained with a pipeline of one's own can be loaded from then on.
    """
    if pipeline not in _LOADED:
        _LOADED[pipeline] = TextVectors(pipeline)
    return _LOADED[pipeline]


def is_text_known(pipeline: object) -> bool:
    """Tell whether a file may name a pipeline: ours, the paper's, or one that is loaded already."""
    return pipeline in (None, PAPER_PIPELINE) or (isinstance(pipeline, str) and pipeline in _LOADED)


def _load_pipeline(pipeline: str | Path) -> Language:
    """Load tokenizer and tok2vec of a pipeline, nothing else of it."""
    import spacy  # here, not above: it imports torch where torch is installed, seconds

    is_folder = pipeline != PAPER_PIPELINE and (Path(pipeline) / "config.cfg").is_file()
    if not is_folder and not spacy.util.is_package(str(pipeline)):
        raise ModuleNotFoundError(
            "text pipeline must be an installed package or a folder with config.cfg, got "
            f"{shorten(str(pipeline))}. Run `python -m spacy download {pipeline}`, or leave it out "
            "to use the shipped pipeline"
        )
    others = ["tagger", "morphologizer", "parser", "senter", "ner", "attribute_ruler", "lemmatizer"]
    return spacy.load(pipeline, exclude=others)


def _check_width(nlp: Language, width: int) -> None:
    has_tok2vec = "tok2vec" in nlp.pipe_names
    found = nlp.get_pipe("tok2vec").model.get_dim("nO") if has_tok2vec else None  # type: ignore[attr-defined]
    if found != width:
        raise ValueError(
            f"text pipeline must have a tok2vec component of width {width}, got {found} in "
            f"{shorten(nlp.meta['name'])}. Use en_core_web_sm or the shipped pipeline"
        )
