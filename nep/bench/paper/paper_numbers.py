"""What the paper reports, for comparison."""

from __future__ import annotations

from collections.abc import Mapping

# Mean and standard deviation.
Number = tuple[float, float]

# Table 1: by name of the setting, see `nep.bench.paper.experiments.Setting`, and by row, named as
# ours.
PAPER_TABLE_1: Mapping[str, Mapping[str, Number]] = {
    "predict_location-on": {
        "random": (0.046, 0.005),
        "priors": (0.159, 0.019),
        "frequentist": (0.271, 0.029),
        "myopic": (0.282, 0.030),
        "bayesian": (0.286, 0.028),
        "HMS": (0.194, 0.023),
        "NEP-MLP": (0.302, 0.032),
        "NEP-GCN": (0.324, 0.034),
        "NEP-HEAT": (0.351, 0.033),
        "oracle": (0.454, 0.039),
    },
    "predict_location-off": {
        "random": (0.044, 0.005),
        "priors": (0.180, 0.025),
        "frequentist": (0.315, 0.038),
        "myopic": (0.339, 0.043),
        "bayesian": (0.308, 0.034),
        "HMS": (0.210, 0.033),
        "NEP-MLP": (0.336, 0.038),
        "NEP-GCN": (0.359, 0.041),
        "NEP-HEAT": (0.391, 0.041),
        "oracle": (0.475, 0.063),
    },
    "relative_likelihood-on": {
        "random": (0.381, 0.001),
        "priors": (0.536, 0.001),
        "frequentist": (0.668, 0.001),
        "myopic": (0.029, 0.000),
        "bayesian": (0.699, 0.002),
        "HMS": (0.529, 0.001),
        "NEP-MLP": (0.661, 0.002),
        "NEP-GCN": (0.728, 0.001),
        "NEP-HEAT": (0.724, 0.002),
        "oracle": (0.932, 0.002),
    },
    "relative_likelihood-off": {
        "random": (0.384, 0.001),
        "priors": (0.546, 0.002),
        "frequentist": (0.728, 0.002),
        "myopic": (0.017, 0.000),
        "bayesian": (0.725, 0.002),
        "HMS": (0.582, 0.002),
        "NEP-MLP": (0.736, 0.002),
        "NEP-GCN": (0.792, 0.002),
        "NEP-HEAT": (0.783, 0.002),
        "oracle": (0.939, 0.002),
    },
    "find_object-on": {
        "random": (8.769, 1.092),
        "priors": (5.911, 1.433),
        "frequentist": (4.550, 1.571),
        "myopic": (6.333, 2.202),
        "bayesian": (3.469, 0.761),
        "HMS": (5.357, 1.379),
        "NEP-MLP": (3.650, 1.035),
        "NEP-GCN": (3.629, 1.042),
        "NEP-HEAT": (3.570, 1.032),
        "oracle": (3.001, 0.772),
    },
    "find_object-off": {
        "random": (8.750, 1.100),
        "priors": (5.869, 1.438),
        "frequentist": (4.218, 1.624),
        "myopic": (6.048, 2.186),
        "bayesian": (3.610, 0.970),
        "HMS": (5.254, 1.458),
        "NEP-MLP": (3.445, 0.948),
        "NEP-GCN": (3.191, 0.866),
        "NEP-HEAT": (3.186, 0.910),
        "oracle": (2.921, 0.764),
    },
}

# Table 2: Predict Object Location with dynamic nodes, by key of
# `nep.bench.paper.experiments.ABLATIONS` (None: the full model) and by name of the model.
PAPER_TABLE_2: Mapping[str | None, Mapping[str, Number]] = {
    None: {"mlp": (0.302, 0.032), "gcn": (0.324, 0.034), "heat": (0.351, 0.033)},
    "no_prior": {"mlp": (0.260, 0.028), "gcn": (0.233, 0.024), "heat": (0.267, 0.029)},
    "no_transformer": {"mlp": (0.263, 0.028), "gcn": (0.310, 0.034), "heat": (0.314, 0.032)},
    "no_temporal": {"mlp": (0.288, 0.032), "gcn": (0.320, 0.033), "heat": (0.322, 0.031)},
    "no_semantic": {"mlp": (0.263, 0.027), "gcn": (0.322, 0.030), "heat": (0.328, 0.030)},
}
