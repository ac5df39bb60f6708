"""The first step of a training is what it was before its operations were made faster."""

import pytest
import torch

from nep.paper.encoders import HEAT
from nep.paper.loss import balanced_bce
from nep.paper.predictor import NodeEdgePredictor
from nep.paper.query_attention import AttentionConfig

# Loss and, per part, the norm of the gradient, from the plain code that concatenated all features,
# padded each snapshot to the longest and summed over all nodes.
LOSS = 0.427128524
NORMS = {
    "node_embedding": 0.006220564,
    "edge_embedding": 0.004464726,
    "encoder": 0.002788672,
    "query_attention": 0.006562648,
    "head": 0.007968505,
}


def test_loss_and_gradients_of_the_first_step(random_batch):
    torch.manual_seed(0)
    encoder = HEAT(16, heads=2, residual=True, root_weight=False)
    model = NodeEdgePredictor(encoder, AttentionConfig(dropout=0.0))
    graph = random_batch(0, num_snapshots=40, num_furniture=9)
    loss = balanced_bce(model(graph), graph.query_target)
    loss.backward()
    squares = dict.fromkeys(NORMS, 0.0)
    for name, parameter in model.named_parameters():
        squares[name.split(".")[0]] += float(parameter.grad.square().sum())
    assert loss.item() == pytest.approx(LOSS, rel=1e-5)
    assert {part: square**0.5 for part, square in squares.items()} == pytest.approx(NORMS, rel=1e-4)
