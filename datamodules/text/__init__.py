"""Text vectors of labels: a small spaCy Tok2Vec pipeline that ships with the package."""

from datamodules.text.vectors import TextVectors

__all__ = ["TextVectors"]
