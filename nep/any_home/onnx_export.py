"""Trained networks as ONNX graphs; exporting one needs the package `onnx`, running it does not."""

from __future__ import annotations

from functools import partial, reduce
from itertools import starmap
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from datamodules.feature_config import FeatureConfig
from nep.any_home.any_home_module import AnyHomeModule
from nep.any_home.ensemble_linear import EnsembleLinear, SharedInput
from nep.any_home.evidence_embedding import MOST_DEVIATIONS
from nep.any_home.network import AnyHomeNetwork
from nep.training.training_module import TrainingModule
from sgm.evidence.columns import PLACE_COLUMNS, QUESTION_COLUMNS
from sgm.network.network import INPUTS, OUTPUTS

_OPSET, _IR_VERSION = 20, 9  # the first with Gelu; ONNX Runtime reads them from 1.17 on
_FAR = 1e30  # above every logit: what is subtracted where there is no place
_GRID = 2.0**30  # means over places are of whole numbers of 1 / _GRID, equal in any order
_WANTED = {"memory": True, "absence": True, "candidates": "all", "text_pipeline": None}


def is_exportable(module: TrainingModule, features: FeatureConfig) -> bool:
    """Tell whether a network is the one for any home, with features that a robot has."""
    return (
        isinstance(module, AnyHomeModule)
        and all(getattr(features, name) == value for name, value in _WANTED.items())
        and {*features.groups, "prior"} == {"evidence", "prior"}
    )


def make_onnx(module: TrainingModule, features: FeatureConfig) -> bytes:
    """Write a network as an ONNX model of the same answers.

    Each member of an ensemble is a chain of its own. The answer is the logarithm of the mean of
    their probabilities, as in `AnyHomeNetwork.join_members`. Products are in float32: ONNX
    Runtime computes their rows alike in any batch. What is added to them and the
    softmax are in float64.

    Args:
        module: a network that `is_exportable`.
        features: that it was trained with.
    """
    from onnx import TensorProto, checker, helper

    graph = _Graph()
    with torch.no_grad():
        _Writer(graph, module.predictor, features).write()
    model = helper.make_model(
        helper.make_graph(
            graph.nodes,
            "node_edge_predictor",
            [
                helper.make_tensor_value_info(name, TensorProto.FLOAT, axes)
                for name, axes in INPUTS.items()
            ],
            [
                helper.make_tensor_value_info(name, TensorProto.DOUBLE, axes)
                for name, axes in OUTPUTS.items()
            ],
            graph.constants,
        ),
        opset_imports=[helper.make_opsetid("", _OPSET)],
        ir_version=_IR_VERSION,
        producer_name="scene-graph-memory",
    )
    checker.check_model(model, full_check=True)
    content: bytes = model.SerializeToString(deterministic=True)
    return content


class _Graph:
    """Nodes and constants of an ONNX graph; a method returns the name of what it computes."""

    def __init__(self) -> None:
        self.nodes: list[Any] = []
        self.constants: list[Any] = []

    def add(self, operator: str, *inputs: str, name: str = "", **attributes: Any) -> str:
        """Apply an operator."""
        from onnx import helper

        name = name or f"{operator}_{len(self.nodes)}"
        self.nodes.append(helper.make_node(operator, inputs, [name], **attributes))
        return name

    def constant(self, values: Any, dtype: type = np.float32) -> str:
        """Keep numbers in the file."""
        from onnx import numpy_helper

        name = f"constant_{len(self.constants)}"
        array = np.ascontiguousarray(values, dtype).reshape(np.shape(values))
        self.constants.append(numpy_helper.from_array(array, name))
        return name

    def cast(self, values: str, dtype: type) -> str:
        """Turn float32 into float64, or back."""
        from onnx import TensorProto

        element_type = TensorProto.DOUBLE if dtype is np.float64 else TensorProto.FLOAT
        return self.add("Cast", values, to=element_type)

    def linear(self, values: str, weight: Tensor, bias: Tensor | None = None) -> str:
        """Multiply rows by a matrix of (in, out), and add a vector."""
        product = self.add("MatMul", values, self.constant(weight))
        return product if bias is None else self.add("Add", product, self.constant(bias))

    def gelu(self, values: str) -> str:
        """Apply the activation of `nep.any_home.ensemble_linear.gelu`."""
        return self.add("Gelu", values, approximate="tanh")


class _Writer:
    """Writes a network into a graph: what all members read, then each member, then their mean.

    Its methods return the names of what they compute, of shapes (Q, F, D) for places and (Q, 1, D)
    for questions, and follow `AnyHomeNetwork` and its parts.
    """

    def __init__(self, graph: _Graph, network: AnyHomeNetwork, features: FeatureConfig) -> None:
        """Write the inputs, hidden and standardised as the network has learnt."""
        self.graph, self.network, self.features = graph, network, features
        evidence = network.evidence_embedding
        place = _hide(graph, "place", PLACE_COLUMNS, features)
        question = _hide(graph, "question", QUESTION_COLUMNS, features)
        self.beliefs = graph.cast(place, np.float64)
        self.of_elsewhere = graph.cast(question, np.float64)
        self.place = _standardise(graph, place, evidence.place_scale)
        self.question = _standardise(graph, question, evidence.question_scale)
        unit, self.axis = graph.constant(1.0), graph.constant([1], np.int64)
        self.is_place = graph.cast("is_place", np.float64)
        self.far = graph.add("Mul", graph.add("Sub", "is_place", unit), graph.constant(_FAR))
        self.far64 = graph.cast(self.far, np.float64)
        number = graph.add("ReduceSum", "is_place", self.axis)
        self.num_places = graph.add("Max", number, unit)
        self.grid = graph.constant(_GRID, np.float64)

    def write(self) -> None:
        """Write the members and the outputs."""
        graph, members = self.graph, self.network.members
        answers = [self._answer(member) for member in range(members)]
        if members == 1:
            for name, logits in zip(OUTPUTS, answers[0], strict=True):
                graph.add("Mul", logits, graph.constant(1.0, np.float64), name=name)
            return
        count = graph.constant(float(members), np.float64)
        least = graph.constant(np.finfo(np.float64).tiny, np.float64)
        shared = zip(*starmap(self._share, answers), strict=True)
        for name, shares in zip(OUTPUTS, shared, strict=True):
            total = reduce(partial(graph.add, "Add"), shares)
            mean = graph.add("Div", total, count)
            graph.add("Log", graph.add("Max", mean, least), name=name)

    def _answer(self, member: int) -> tuple[str, str]:
        """Write the logits of places and of elsewhere of one member, (Q, F, 1) and (Q, 1, 1)."""
        graph, network, evidence = self.graph, self.network, self.network.evidence_embedding
        node, edge = self._compare(self._embed(member), member), self._embed_edge(member)
        weight, bias = _take(network.head[0], member)
        of_node, of_edge = weight.chunk(2)
        asked = _embed_node(network, 1, member)
        hidden = graph.add(
            "Add",
            graph.linear(node, of_node / 2, _add(bias, asked @ of_node / 2)),
            graph.linear(edge, of_edge),
        )
        for layer in (network.head[2], network.head[4]):
            hidden = graph.linear(graph.add("Relu", hidden), *_take(layer, member))
        logits = graph.cast(hidden, np.float64)
        shortcut = torch.zeros(len(PLACE_COLUMNS), 1, dtype=torch.float64)
        shortcut[evidence.belief_columns, 0] = evidence.shortcut.weight[member].double()
        by_place = graph.add("MatMul", self.beliefs, graph.constant(shortcut, np.float64))
        places = graph.add("Add", graph.add("Add", logits, by_place), self.far64)
        return places, self._answer_elsewhere(node, member)

    def _embed(self, member: int) -> str:
        """Write the evidence of the places, of a node of their type."""
        graph, network, evidence = self.graph, self.network, self.network.evidence_embedding
        first, bias = _take(evidence.place, member, network.members)
        about, _ = _take(evidence.question, member, network.members)
        asked = graph.linear(self.question, about, bias)
        hidden = graph.gelu(graph.add("Add", graph.linear(self.place, first), asked))
        hidden = graph.gelu(graph.linear(hidden, *_take(evidence.second, member)))
        node = _embed_node(network, 0, member)
        return graph.add("Add", hidden, graph.constant(node))

    def _compare(self, hidden: str, member: int) -> str:
        """Write `Sets`."""
        graph, sets, first = self.graph, self.network.sets, hidden
        for transform, shared, update in zip(sets.own, sets.shared, sets.update, strict=True):
            mean, most = self._pool(hidden)
            weight, bias = _take(transform, member)
            of_mean, of_most = _take(shared, member)[0].chunk(2)
            both = graph.add(
                "Add", graph.linear(mean, of_mean, bias), graph.linear(most, of_most)
            )  # (Q, 1, D)
            hidden = graph.gelu(graph.add("Add", graph.linear(hidden, weight), both))
            hidden = graph.gelu(graph.linear(hidden, *_take(update, member)))
        return graph.add("Add", hidden, first)

    def _pool(self, hidden: str) -> tuple[str, str]:
        """Write mean and maximum over the places, (Q, 1, D) each."""
        graph, axis = self.graph, self.axis
        scaled = graph.add("Mul", graph.cast(hidden, np.float64), self.grid)
        whole = graph.add("Mul", graph.add("Round", scaled), self.is_place)
        total = graph.add("Div", graph.add("ReduceSum", whole, axis), self.grid)
        mean = graph.add("Div", graph.cast(total, np.float32), self.num_places)
        return mean, graph.add("ReduceMax", graph.add("Add", hidden, self.far), axis)

    def _embed_edge(self, member: int) -> str:
        """Write the embedding of the query edges."""
        graph, embedding = self.graph, self.network.edge_embedding
        weight, bias = _take(embedding.first, member, self.network.members)  # (1 + relations, D)
        prior, first, *others = weight
        bias = _add(bias, first)
        weights = torch.stack([prior * self.features.prior, *(other - first for other in others)])
        hidden = graph.linear("edge", weights, bias)
        hidden = graph.linear(graph.add("Relu", hidden), *_take(embedding.second, member))
        return graph.add("Relu", hidden)

    def _answer_elsewhere(self, node: str, member: int) -> str:
        """Write the logit of elsewhere of one member, float64 (Q, 1, 1)."""
        graph, head = self.graph, self.network.elsewhere
        mean, most = self._pool(node)
        weight, bias = _take(head.places, member)
        of_mean, of_most = weight.chunk(2)
        about, _ = _take(head.question, member, self.network.members)
        of_places = graph.add("Add", graph.linear(mean, of_mean, bias), graph.linear(most, of_most))
        hidden = graph.gelu(graph.add("Add", of_places, graph.linear(self.question, about)))
        logit = graph.cast(graph.linear(hidden, *_take(head.last, member)), np.float64)
        shortcut = torch.zeros(len(QUESTION_COLUMNS), 1, dtype=torch.float64)
        shortcut[head.belief_columns, 0] = head.shortcut.weight[member].double()
        by_belief = graph.add("MatMul", self.of_elsewhere, graph.constant(shortcut, np.float64))
        return graph.add("Add", logit, by_belief)

    def _share(self, places: str, elsewhere: str) -> tuple[str, str]:
        """Write the probabilities of one member.

        The softmax s of the places l_i gives the logarithm of the sum of their exponentials as
        max l - log max s.
        """
        graph = self.graph
        shares = graph.add("Softmax", places, axis=1)
        most, largest = (graph.add("ReduceMax", values, self.axis) for values in (places, shares))
        odds = graph.add("Sub", elsewhere, graph.add("Sub", most, graph.add("Log", largest)))
        gone = graph.add("Sigmoid", odds)
        present = graph.add("Sub", graph.constant(1.0, np.float64), gone)
        return graph.add("Mul", shares, present), gone


def _take(layer: nn.Module, member: int, shared: int = 1) -> tuple[Tensor, Tensor | None]:
    """Return matrix (in, out) and vector of one member, of `shared` side by side in one layer."""
    assert isinstance(layer, (nn.Linear, EnsembleLinear))
    bias: Tensor | None = layer.bias
    weight = layer.weight.double()
    if isinstance(layer, EnsembleLinear):
        return weight[member], None if bias is None else bias[member, 0].double()
    weight = weight.t().chunk(shared, dim=1)[member]
    return weight, None if bias is None else bias.double().chunk(shared)[member]


def _embed_node(network: AnyHomeNetwork, row: int, member: int) -> Tensor:
    """Return the vector of a place (0) or of an object (1), (D,)."""
    embedding: SharedInput = network.node_embedding
    weight, bias = _take(embedding.first, member, network.members)
    first = torch.relu(_add(bias, weight[row]))
    weight, bias = _take(embedding.second, member)
    return torch.relu(_add(bias, first @ weight))


def _add(bias: Tensor | None, values: Tensor) -> Tensor:
    return values if bias is None else values + bias


def _hide(graph: _Graph, name: str, columns: tuple[str, ...], features: FeatureConfig) -> str:
    """Return an input without the groups that are switched off."""
    is_on = [features.shows(column) for column in columns]
    return name if all(is_on) else graph.add("Mul", name, graph.constant(is_on))


def _standardise(graph: _Graph, values: str, scale: nn.BatchNorm1d) -> str:
    assert scale.running_mean is not None
    assert scale.running_var is not None
    factor = (scale.running_var.double() + scale.eps) ** -0.5
    centred = graph.add("Sub", values, graph.constant(scale.running_mean))
    most = [graph.constant(sign * MOST_DEVIATIONS) for sign in (-1, 1)]
    return graph.add("Clip", graph.add("Mul", centred, graph.constant(factor)), *most)
