"""Where to look for something, asked of a memory and a trained network."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sgm.belief import Detector
from sgm.finder.finder import Finder
from sgm.network.network import Network, has_onnx
from sgm.network.policy import NetworkPolicy
from sgm.network.shipped import find_trained
from sgm.text import load_text


class ObjectFinder(Finder):
    """Answers where an object is, from a `SceneGraphMemory` alone, on one CPU thread.

    A `Finder` whose policy is a trained network. Any words will do: labels of rooms, furniture and
    objects that no training home had are known by their text vectors. Networks that read evidence
    alone, such as "any_home", are run by ONNX Runtime; `nep.ObjectFinder` runs others with torch.

    Example:
        >>> finder = ObjectFinder.load()
        >>> for place in finder.rank(memory, "large red mug", k=5):
        ...     print(place.name, place.probability, place.why)
    """

    def __init__(
        self,
        model: Any,
        detector: Detector | None = None,
        asks_moved: float = 0.0,
    ) -> None:
        """Ask a trained network; `load` reads one from disk.

        Args:
            model: the network: a `Network`, or in `nep` one that torch runs.
            detector: as in `load`.
            asks_moved: as in `Finder`.

        Raises:
            ValueError: if the network reads the belief of a filter, which knows the rules of
                simulated homes, or the share is out of range.
        """
        policy = self._make_policy(model, asks_moved)
        super().__init__(policy, detector, asks_moved)
        self._text = load_text(policy.text_pipeline)

    @classmethod
    def load(
        cls,
        source: str | Path = "any_home",
        detector: Detector | None = None,
        asks_moved: float = 0.0,
    ) -> ObjectFinder:
        """Load a trained network; nothing in the files is executed.

        Args:
            source: "any_home" or "heat", which ship with the package; a folder of
                `python -m nep.export`; a checkpoint of `python -m nep.fit`; or such a folder on a
                hub, "hf://owner/name" (extra hub).
            detector: how often a look misses what is there; None to learn it from each memory
                (`Detector.estimate`).
            asks_moved: as in `Finder`; networks without evidence, such as "heat", answer as if it
                were 0.5.

        Raises:
            FileNotFoundError: if there is no such file; it is a `ValueError`, too.
            ModuleNotFoundError: if it is on a hub, and huggingface_hub is not installed.
            ValueError: if the file is damaged, or it was made for another feature
                schema or other text vectors than those installed; or if it needs torch, and that
                is not installed.
        """
        return cls(cls._read(find_trained(source)), detector, asks_moved)

    @classmethod
    def _read(cls, path: Path) -> Any:
        """Read a network; `ValueError` if it cannot be read, or not be run here."""
        if not (path.is_dir() and has_onnx(path)):
            raise ValueError(
                "network must read evidence alone to be run without torch, got one without "
                f"network.onnx in {path}. Take 'any_home', or install scene-graph-memory and ask "
                "nep.ObjectFinder."
            )
        return Network.load(path)

    def _make_policy(self, model: Any, asks_moved: float) -> Any:
        """Return the policy that asks a network, and says whose text vectors that reads.

        `NetworkPolicy`, or one of its kind: with `text_pipeline` and `ask_anew`.
        """
        return NetworkPolicy(model, asks_moved)
