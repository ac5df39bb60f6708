"""A trained Node Edge Predictor as one more policy."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from datamodules.batch import QUERY_EDGE_TYPES
from datamodules.features import FEATURE_SCHEMA_VERSION, FeatureConfig
from datamodules.graph import GraphBuilder
from nep.module import NEPModule
from simulator.config import HouseConfig
from simulator.memory.memory_batch import Change, MemoryBatch, Queries
from simulator.memory.snapshots import take_snapshots
from simulator.policies import Policy
from simulator.policies.home_filter import HomeFilter
from simulator.prior_graph import PriorGraph


class NEPPolicy(Policy):
    """Scores all queries of all homes in one forward pass.

    A furniture node's score is the highest logit of its query edges.
    """

    score_kind = "logits"

    def __init__(
        self, module: NEPModule, builder: GraphBuilder, believer: HomeFilter | None = None
    ) -> None:
        """Keep the model and what turns snapshots into its batches.

        Args:
            module: the model.
            builder: with the features that it was trained on.
            believer: the filter whose belief is among the features; None if there is none.
        """
        self._module = module
        self._builder = builder
        self._believer = believer

    def with_rules(self, prior: PriorGraph, config: HouseConfig) -> NEPPolicy:
        """Return the same network with the rules of the homes, if it reads a filter's belief."""
        believer = HomeFilter(prior, config) if self._builder.config.belief else None
        return NEPPolicy(self._module, self._builder, believer)

    def reset(self, memory: MemoryBatch) -> None:
        """Forget earlier homes."""
        if self._believer is not None:
            self._believer.reset(memory)

    def observe(self, memory: MemoryBatch, change: Change) -> None:
        """Tell the filter about a look."""
        if self._believer is not None:
            self._believer.observe(memory, change)

    @classmethod
    def load(cls, checkpoint: str | Path) -> NEPPolicy:
        """Load a checkpoint that `python -m nep.fit` wrote; nothing in it is executed.

        Args:
            checkpoint: path of the file.

        Raises:
            ValueError: if there is no such file, it is not such a checkpoint, or it was trained
                with another feature schema or other text vectors than those installed.
        """
        try:
            content = torch.load(checkpoint, map_location="cpu", weights_only=True)
            data = content["datamodule_hyper_parameters"]
            # Checkpoints from before the schema was written down have the first one.
            check_feature_schema(data.get("feature_schema", 1), checkpoint)
            features = FeatureConfig(**data["features"])
            module = NEPModule.load_from_checkpoint(
                checkpoint, map_location="cpu", weights_only=True
            )
        except OSError as error:
            raise ValueError(
                f"checkpoint must be a file that can be read, got {error.strerror!r} for "
                f"{checkpoint}. Train one with `python -m nep.fit`, or check the path."
            ) from error
        except (pickle.UnpicklingError, EOFError, KeyError, TypeError, RuntimeError) as error:
            raise ValueError(
                f"checkpoint must be one that nep.fit wrote, got {type(error).__name__} for "
                f"{checkpoint}. Train again, or check the path."
            ) from error
        builder = GraphBuilder(features, module.num_hops)
        if builder.text_name != data["text"]:
            raise ValueError(
                f"text vectors must be {data['text']}, got {builder.text_name} for {checkpoint}. "
                "Install the version of the package that trained it, or train again."
            )
        return cls(module, builder)

    @torch.inference_mode()
    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return logits, (Q, F), -inf where there is no query edge."""
        was_training = self._module.training
        self._module.eval()
        snapshots = take_snapshots(memory, queries)
        if self._believer is not None:
            belief = self._believer.follow(memory, queries).stack()
            snapshots = replace(snapshots, query_belief=belief)
        batch = self._builder.build(snapshots)
        logits = self._module(batch.to(self._module.device)).cpu().numpy()
        self._module.train(was_training)
        scores = np.full((len(queries.home), memory.num_furniture), -np.inf)
        graph = batch.graph
        local = graph.nodes["furniture"].data["index"]
        query_snapshots, places = [], []
        for etype in QUERY_EDGE_TYPES:
            query = graph.edges[etype].data["query"]
            furniture = graph.edges(etype=etype)[1]
            query_snapshots.append(query[query >= 0])
            places.append(local[furniture[query >= 0]])
        np.maximum.at(
            scores, (torch.cat(query_snapshots).numpy(), torch.cat(places).numpy()), logits
        )
        return scores


def check_feature_schema(version: int, checkpoint: str | Path) -> None:
    """Check that a checkpoint reads the features that this package makes.

    Raises:
        ValueError: if its feature schema is another one.
    """
    if version != FEATURE_SCHEMA_VERSION:
        raise ValueError(
            f"checkpoint must have feature schema {FEATURE_SCHEMA_VERSION}, got {version} for "
            f"{checkpoint}. Train again, or install the version of the package that trained it."
        )
