"""Text encoders that spaCy computes: the one of the paper, and pipelines of one's own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from sgm.messages import shorten
from sgm.text.tok2vec import WIDTH, FloatArray, scale_mean

if TYPE_CHECKING:
    from spacy.language import Language

PAPER_PIPELINE = "en_core_web_sm"
_UNUSED = ["tagger", "morphologizer", "parser", "senter", "ner", "attribute_ruler", "lemmatizer"]


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

    def encode(self, texts: Sequence[str]) -> Iterator[FloatArray]:
        """Give the vector of each text, float32 (96,)."""
        for doc in self._nlp.pipe(texts):
            yield scale_mean(doc.tensor)


def load_spacy(pipeline: str | Path) -> SpacyEncoder:
    """Load the encoder of a pipeline from a folder or an installed package.

    Raises:
        ModuleNotFoundError: if spaCy or the package is not installed.
        ValueError: if it has no tok2vec component of width 96.
    """
    return SpacyEncoder(load_language(pipeline))


def load_language(pipeline: str | Path) -> Language:
    """Load a pipeline of spaCy; the name of the paper's is never that of a folder.

    Raises:
        ModuleNotFoundError: if spaCy or the package is not installed.
    """
    try:
        import spacy  # here, not above: it imports torch where torch is installed, seconds
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"spaCy must be installed for the text pipeline {shorten(str(pipeline))}, got "
            f"{shorten(str(error))}. Run `pip install 'spacy>=3.8,<4'`, or leave the pipeline out "
            "to use the shipped one"
        ) from error
    is_folder = pipeline != PAPER_PIPELINE and (Path(pipeline) / "config.cfg").is_file()
    if not is_folder and not spacy.util.is_package(str(pipeline)):
        raise ModuleNotFoundError(
            "text pipeline must be an installed package or a folder with config.cfg, got "
            f"{shorten(str(pipeline))}. Run `python -m spacy download {pipeline}`, or leave it out "
            "to use the shipped pipeline"
        )
    return spacy.load(pipeline, exclude=_UNUSED)
