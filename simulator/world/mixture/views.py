"""The prior as the agent of a home knows it: right, blurred, wrong, in other words, or not.

The words that the prior does not know are synonyms, and names of other things (`data/words.csv`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import chain

import numpy as np

from sgm.files import read_table
from simulator.world.homes import list_labels
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams


@dataclass(frozen=True, slots=True)
class Words:
    """Words of one split.

    Attributes:
        synonyms: other words for a label of the shipped prior, by label.
        strangers: names of things that are in no table of ours.
    """

    synonyms: Mapping[str, tuple[str, ...]]
    strangers: tuple[str, ...]


@lru_cache(maxsize=2)
def load_words(split: str) -> Words:
    """Read `words.csv`; "train" and "val" share their words, and have none of those of "test"."""
    part = "test" if split == "test" else "train"
    synonyms: dict[str, tuple[str, ...]] = {}
    strangers: tuple[str, ...] = ()
    for entry in read_table("simulator.world.mixture", "words.csv"):
        if entry["split"] != part:
            continue
        words = tuple(entry["words"].split("|"))
        if entry["label"]:
            synonyms[entry["label"]] = words
        else:
            strangers = words
    return Words(synonyms, strangers)


def list_words() -> list[str]:
    """List every word of both splits, in the order of the file."""
    found: list[str] = []
    for words in map(load_words, ("train", "test")):
        found += [*chain.from_iterable(words.synonyms.values()), *words.strangers]
    return list(dict.fromkeys(found))


TRUE = "true"  # as the homes were drawn
NOISY = "noisy"  # weights blurred, and some forgotten
UNKNOWN_WORDS = "unknown words"  # noisy, and part of the labels are words that it does not know
OTHER_HOME = "other home"  # the weights of other types: confident and wrong
NONE = "none"  # no weights
BLENDED = "blended"  # half the true weights, half those of other types; in test homes alone
VIEWS = (TRUE, NOISY, UNKNOWN_WORDS, OTHER_HOME, NONE, BLENDED)
DEFAULT_VIEWS = {TRUE: 0.25, NOISY: 0.2, UNKNOWN_WORDS: 0.35, OTHER_HOME: 0.1, NONE: 0.1}

_UNKNOWN_SHARE = 0.4  # of the labels of a home with unknown words
_STRANGER_SHARE = 0.25  # of these: names of other things, which say nothing
_SYNONYM_SHARE = 0.35  # of these: synonyms, where there are any; all others keep their word
_FORGOTTEN_SHARE = 0.3  # of the weights of a noisy prior
_NOISE = (0.3, 1.5)  # standard deviation of the logarithm of the others, evenly in between


class MixedHomes(SampledHomes):
    """Sampled homes whose agents know the prior each in their own way.

    The true homes follow the true prior. What an agent does not know has no prior weight anywhere,
    whether it is called by another word, then all of its type in the home are, or by its own.

    Attributes:
        views: one of `VIEWS` for each home, (H,).
    """

    views: tuple[str, ...]

    @property
    def labels(self) -> list[str]:
        """House, floor, all that the prior names, and every word that a home may use instead."""
        return list_labels(self.prior, list_words())

    def set_views(self, views: tuple[str, ...]) -> None:
        """Say how the agent of each home knows the prior, (H,); once, before a memory is made."""
        self.views = views
        self._is_unknown = np.zeros(self.type_labels.shape, dtype=bool)
        for home, view in enumerate(views):
            if view == UNKNOWN_WORDS:
                self._rename(home)

    def view_prior(self, weights: np.ndarray) -> np.ndarray:
        """Return the prior, (H, O, F, relations), as the agents of these homes know it."""
        seen = weights.copy()
        for home, view in enumerate(self.views):
            if view == TRUE:
                continue
            known = seen[home, :, : self.home_num_furniture[home]]
            if view == UNKNOWN_WORDS:
                known[self._is_unknown[home, : len(known)]] = 0  # nor may words lead there
            rng = self.streams.generator("prior view", home)
            if view == NONE:
                known[:] = 0
            if view in (NOISY, UNKNOWN_WORDS):
                known[rng.random(known.shape) < _FORGOTTEN_SHARE] = 0
                known *= np.exp(rng.uniform(*_NOISE) * self._draw_noise(rng, known.shape))
            if view in (OTHER_HOME, BLENDED):
                others = known[rng.permutation(len(known))]
                known[:] = others if view == OTHER_HOME else (known + others) / 2
            total = known.sum(axis=(1, 2), keepdims=True)
            np.divide(known, total, out=known, where=total > 0)
        return seen

    def _draw_noise(self, rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
        """Draw normal noise of weights, (O, F, relations), by which a home differs from the prior.

        A third of its variance is that of a place and a third that of a kind: what is kept
        together elsewhere is kept together here, so that no mean over similar things removes it.
        """
        place, kin, pair = (rng.normal(size=size) for size in ((1, *shape[1:]), shape, shape))
        return (place + np.einsum("op,pfr->ofr", self._kinship, kin) + pair) / np.sqrt(3)

    @cached_property
    def _kinship(self) -> np.ndarray:
        """How alike the object types of the prior are kept, rows of length one, (O, O)."""
        weights = self.prior.weights.reshape(len(self.prior.objects), -1)
        length = np.sqrt((weights**2).sum(axis=1, keepdims=True))
        unit = np.divide(weights, length, out=np.zeros_like(weights), where=length > 0)
        alike = (unit @ unit.T) ** 4 + np.eye(len(unit)) * (length == 0)
        return alike / np.sqrt((alike**2).sum(axis=1, keepdims=True))

    def _rename(self, home: int) -> None:
        """Let the prior not know part of the types, and give part of the labels other words."""
        words = load_words(self.streams.split)
        rng = self.streams.generator("words", home)
        free = list(rng.permutation(words.strangers))
        furniture = self.furniture_labels[home]
        places = dict.fromkeys(furniture[furniture != ""].tolist())
        new: dict[str, str] = {}
        for label in dict.fromkeys([*self.type_labels[home], *places]):
            chance, replacement, choice = rng.random(3)
            synonyms = words.synonyms.get(label, ())
            if chance >= _UNKNOWN_SHARE:
                continue
            if replacement < _STRANGER_SHARE and free:
                new[label] = str(free.pop())
            elif synonyms and (replacement < _STRANGER_SHARE + _SYNONYM_SHARE or label in places):
                new[label] = synonyms[int(choice * len(synonyms))]
            elif label not in places:
                new[label] = label  # its own word, of which the agent knows nothing
        for number, label in enumerate(self.type_labels[home]):
            if label in new:
                self.type_labels[home, number] = new[label]
                self.prior_types[home, number] = -1
                self._is_unknown[home, number] = True
        self.furniture_labels[home] = [new.get(label, label) for label in furniture]


def draw_views(streams: Streams, shares: dict[str, float]) -> tuple[str, ...]:
    """Draw how the agent of each home knows the prior, (H,), with the given weights.

    In test homes, half of those that would have a noisy prior have a blended one.
    """
    names = list(shares)
    weights = np.array([shares[name] for name in names])
    summed = np.cumsum(weights) / weights.sum()
    views = []
    for home in range(len(streams.homes)):
        rng = streams.generator("view", home)
        view = names[int(np.searchsorted(summed, rng.random(), side="right"))]
        is_blended = rng.random() < 0.5 and streams.split == "test" and view == NOISY
        views.append(BLENDED if is_blended else view)
    return tuple(views)
