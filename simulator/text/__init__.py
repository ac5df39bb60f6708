"""Text vectors by the name that they had: they are in `sgm.text`."""

from sgm.text import PAPER_PIPELINE, TextVectors, is_text_known, load_text

__all__ = ["PAPER_PIPELINE", "TextVectors", "is_text_known", "load_text"]
