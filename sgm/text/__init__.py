"""Text vectors of labels: a small spaCy Tok2Vec pipeline that ships with the package."""

from sgm.text.vectors import PAPER_PIPELINE, TextVectors, is_text_known, load_text

__all__ = ["PAPER_PIPELINE", "TextVectors", "is_text_known", "load_text"]
