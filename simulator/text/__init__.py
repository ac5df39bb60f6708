"""Text vectors of labels: a small spaCy Tok2Vec pipeline that ships with the package."""

from simulator.text.vectors import PAPER_PIPELINE, TextVectors

__all__ = ["PAPER_PIPELINE", "TextVectors"]
