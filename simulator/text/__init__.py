"""Text vectors of labels: a small spaCy Tok2Vec pipeline that ships with the package."""

from simulator.text.vectors import TextVectors

__all__ = ["TextVectors"]
