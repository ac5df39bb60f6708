"""The network that benchmarks play with: NEP-HEAT, untrained, as fast as a trained one."""

from __future__ import annotations

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from nep.paper.encoders import HEAT
from nep.paper.nep_module import NEPModule
from nep.players.policy import NEPPolicy


def make_policy() -> NEPPolicy:
    """Make the policy, ready to answer."""
    return NEPPolicy(NEPModule(HEAT()).eval(), BatchBuilder(FeatureConfig(), num_hops=1))
