"""What an agent sees when it looks at a furniture node."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace

import numpy as np

from sgm.messages import shorten
from sgm.schema import PlaceCode
from simulator.world.homes import Homes
from simulator.world.parts import Part, Registry

_NUMBERS_OF_DETECTION = 3  # its confidence, whether it is right, what it is taken for


@dataclass(frozen=True, slots=True)
class Observation:
    """One look in each of some homes: a furniture node and what was detected there.

    Attributes:
        home: which homes looked, ascending, (n,).
        furniture: the furniture index each of them looked at, (n,).
        coverage: share of the furniture that was in view, in (0, 1], (n,).
        seen_home: home of each detected object, ascending, (m,).
        seen_code: its description code, (m,).
        seen_relation: by number in `RELATIONS`, (m,).
        seen_confidence: probability that such an object is there indeed, in [0, 1], (m,).
    """

    home: np.ndarray
    furniture: np.ndarray
    coverage: np.ndarray
    seen_home: np.ndarray
    seen_code: np.ndarray
    seen_relation: np.ndarray
    seen_confidence: np.ndarray


class Sensing(Part, ABC):
    """What looks show; a frozen dataclass of numbers."""

    __slots__ = ()

    @abstractmethod
    def observe(self, homes: Homes, looking: np.ndarray, furniture: np.ndarray) -> Observation:
        """Look at one furniture node in each of some homes.

        Random numbers come from `homes.streams`, from rows taken for the homes that look alone, as
        wide as each home needs: so a home does not depend on those beside it.

        Args:
            homes: the group.
            looking: homes that look, ascending, (n,).
            furniture: furniture index that each looks at, (n,).
        """


SENSING = Registry(
    Sensing,  # type: ignore[type-abstract]
    "sensing",
    constant_misses="simulator.world.sensing.ConstantMisses",
    misses_per_type="simulator.world.sensing.MissesPerType",
    misses_per_furniture="simulator.world.sensing.MissesPerFurniture",
    partial_views="simulator.world.sensing.PartialViews",
    confidences="simulator.world.sensing.Confidences",
)


class Misses(Sensing):
    """Objects are missed, each independently of the others; what is seen is there."""

    __slots__ = ()

    def observe(self, homes: Homes, looking: np.ndarray, furniture: np.ndarray) -> Observation:
        """Look; see `Sensing.observe`."""
        coverage = self.draw_coverage(homes, looking)
        miss_rate = self.compute_miss_rates(homes, looking, furniture)
        if coverage is not None:
            miss_rate = 1 - coverage[:, None] * (1 - miss_rate)
        # Only homes that look draw numbers: a home's numbers do not depend on its neighbours.
        uniform = homes.streams.rows("detection", homes.home_num_slots).take(looking)  # (n, C)
        places = homes.object_place[looking]
        is_seen = PlaceCode.furniture(places) == furniture[:, None]
        is_seen &= uniform >= miss_rate
        look, slot = np.divmod(np.flatnonzero(is_seen), homes.num_slots)
        home = looking[look]
        return Observation(
            home=looking,
            furniture=furniture,
            coverage=np.ones(len(looking)) if coverage is None else coverage,
            seen_home=home,
            seen_code=homes.object_code[home, slot],
            seen_relation=PlaceCode.relation(homes.object_place[home, slot]),
            seen_confidence=np.ones(len(home)),
        )

    @abstractmethod
    def compute_miss_rates(
        self, homes: Homes, looking: np.ndarray, furniture: np.ndarray
    ) -> np.ndarray:
        """Return the probability that an object in view is missed, (n, 1) or by slot (n, C)."""

    def draw_coverage(self, homes: Homes, looking: np.ndarray) -> np.ndarray | None:
        """Draw the share of the furniture that each look has in view, (n,); None for all of it."""
        return None


@dataclass(frozen=True)
class ConstantMisses(Misses):
    """Every object is missed with the home's `detection_error`.

    Source: appendix "Detection error"; docs/design.md, ruling 11.
    """

    def compute_miss_rates(
        self, homes: Homes, looking: np.ndarray, furniture: np.ndarray
    ) -> np.ndarray:
        """Return the detection error of each home, (n, 1)."""
        return homes.detection_error[looking, None]


@dataclass(frozen=True)
class PartialViews(ConstantMisses):
    """A look has a part of the furniture in view, and says how much of it.

    Each object is in view with the coverage of the look, and is then missed with the home's
    `detection_error`.

    Attributes:
        lowest: coverages are drawn from U(lowest, 1).
    """

    lowest: float = 0.25

    def __post_init__(self) -> None:
        """Raise ValueError if the lowest coverage is not in (0, 1]."""
        if not 0 < self.lowest <= 1:
            raise ValueError(
                f"lowest must be above 0 and at most 1, got {self.lowest}. Give a share in view."
            )

    def draw_coverage(self, homes: Homes, looking: np.ndarray) -> np.ndarray:
        """Draw a coverage per look, (n,)."""
        uniform = homes.streams.rows("coverage", 1).take(looking)[:, 0]
        return self.lowest + (1 - self.lowest) * uniform


@dataclass(frozen=True)
class Confidences(ConstantMisses):
    """Every detection says with which probability it is right, and is right that often.

    An object that is seen, as in `ConstantMisses`, is detected with a confidence c drawn from
    U(lowest, 1). With probability 1 - c it is taken for an object that is elsewhere in the home;
    where there is none, it is taken for what it is.

    Attributes:
        lowest: the lowest confidence.
    """

    lowest: float = 0.25

    def __post_init__(self) -> None:
        """Raise ValueError if the lowest confidence is not in [0, 1]."""
        if not 0 <= self.lowest <= 1:
            raise ValueError(
                f"lowest must lie in [0, 1], got {self.lowest}. Give the lowest confidence."
            )

    def observe(self, homes: Homes, looking: np.ndarray, furniture: np.ndarray) -> Observation:
        """Look; see `Sensing.observe`."""
        seen = ConstantMisses.observe(self, homes, looking, furniture)
        stream = homes.streams.rows("confidence", homes.home_num_slots * _NUMBERS_OF_DETECTION)
        numbers = stream.claim(looking)
        look = np.searchsorted(looking, seen.seen_home)
        turn = np.arange(len(look)) - np.searchsorted(look, look)  # number within its home
        uniform = numbers.read(look, turn * _NUMBERS_OF_DETECTION, _NUMBERS_OF_DETECTION)
        confidence = self.lowest + (1 - self.lowest) * uniform[:, 0]
        code = seen.seen_code.copy()
        for wrong in np.flatnonzero(uniform[:, 1] >= confidence):
            home = seen.seen_home[wrong]
            places = homes.object_place[home]
            is_here = PlaceCode.furniture(places) == furniture[look[wrong]]
            codes = homes.object_code[home]
            elsewhere = np.setdiff1d(codes[(places >= 0) & ~is_here], codes[is_here])
            if len(elsewhere):
                code[wrong] = elsewhere[int(uniform[wrong, 2] * len(elsewhere))]
        return replace(seen, seen_code=code, seen_confidence=confidence)


@dataclass(frozen=True)
class _MissesByLabel(Misses):
    """Rates by a label: the home's `detection_error` for others."""

    rates: Mapping[str, float] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        """Raise ValueError if a rate is not in [0, 1]; names its label."""
        for label, rate in self.rates.items():
            if not 0 <= rate <= 1:
                raise ValueError(
                    f"rate of {shorten(label)} must lie in [0, 1], got {rate}. Give a probability."
                )

    def _get_rates(self, labels: Sequence[str], noun: str, known: Iterable[str]) -> np.ndarray:
        """Return the rate of each label, nan for those without, (n,); all must be of known ones."""
        unknown = sorted(set(self.rates).difference(known))
        if unknown:
            raise ValueError(
                f"rates must be of {noun} of the homes, got {', '.join(unknown)}. Check the labels."
            )
        return np.array([self.rates.get(label, np.nan) for label in labels], dtype=float)


@dataclass(frozen=True)
class MissesPerType(_MissesByLabel):
    """How often an object is missed depends on what it is: keys more often than pillows.

    Attributes:
        rates: by the label of its type.
    """

    def compute_miss_rates(
        self, homes: Homes, looking: np.ndarray, furniture: np.ndarray
    ) -> np.ndarray:
        """Return the rate of the type of each object, (n, C).

        Raises:
            ValueError: if a label is no object type of these homes.
        """
        labels = homes.object_labels
        rates = self._get_rates(labels, "object types", labels)[homes.object_type[looking]]
        return np.where(np.isnan(rates), homes.detection_error[looking, None], rates)


@dataclass(frozen=True)
class MissesPerFurniture(_MissesByLabel):
    """How often objects are missed depends on where they are: in a wardrobe more than on a table.

    Attributes:
        rates: by the label of the furniture.
    """

    def compute_miss_rates(
        self, homes: Homes, looking: np.ndarray, furniture: np.ndarray
    ) -> np.ndarray:
        """Return the rate of the furniture that each home looks at, (n, 1).

        Raises:
            ValueError: if a label is no furniture of these homes or their prior.
        """
        known = {furniture_type.label for furniture_type in homes.prior.furniture}
        if not known.issuperset(self.rates):
            known |= set(homes.furniture_labels.ravel())
        labels = homes.furniture_labels[looking, furniture].tolist()
        rates = self._get_rates(labels, "furniture", known)
        return np.where(np.isnan(rates), homes.detection_error[looking], rates)[:, None]


def observe(homes: Homes, furniture: np.ndarray) -> Observation:
    """Look at one furniture node per home, (H,), -1 for none; its sensing says what is seen."""
    looking = np.flatnonzero(furniture >= 0)  # (n,)
    parts = []
    for sensing, is_member in homes.sensing:
        members = looking[is_member[looking]]
        assert isinstance(sensing, Sensing)  # rules know it as a part of any kind
        parts.append(sensing.observe(homes, members, furniture[members]))
    if len(parts) == 1:
        return parts[0]
    columns = {
        column.name: np.concatenate([getattr(part, column.name) for part in parts])
        for column in fields(Observation)
    }
    order = np.argsort(columns["home"])
    seen = np.argsort(columns["seen_home"], kind="stable")
    return Observation(
        **{
            name: column[seen if name.startswith("seen") else order]
            for name, column in columns.items()
        }
    )
