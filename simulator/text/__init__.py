"""Training of text vectors: `python -m simulator.text.train`. The vectors are in `sgm.text`."""

from sgm.text import PAPER_PIPELINE, TextVectors, is_text_known, load_text

__all__ = ["PAPER_PIPELINE", "TextVectors", "is_text_known", "load_text"]
