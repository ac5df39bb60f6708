"""What the paper reports, for comparison."""

from __future__ import annotations

from collections.abc import Mapping

# Mean, and what stands behind ± in the paper.
Number = tuple[float, float]
# Why tables show the means alone.
ABOUT_SPREAD = (
    "Means alone: the ± of the paper is no deviation over homes. Its released `metrics.py` "
    "computes the variance of an accuracy that was smoothed over ten steps, so it is not "
    "comparable to ours."
)

# Settings of Table 1, see `nep.reproduce.experiments.Setting`. Below, each has two columns.
_SETTINGS = (
    "predict_location-on",
    "predict_location-off",
    "relative_likelihood-on",
    "relative_likelihood-off",
    "find_object-on",
    "find_object-off",
)
_TABLE_1 = """
random        0.046 0.005  0.044 0.005  0.381 0.001  0.384 0.001  8.769 1.092  8.750 1.100
priors        0.159 0.019  0.180 0.025  0.536 0.001  0.546 0.002  5.911 1.433  5.869 1.438
frequentist   0.271 0.029  0.315 0.038  0.668 0.001  0.728 0.002  4.550 1.571  4.218 1.624
myopic        0.282 0.030  0.339 0.043  0.029 0.000  0.017 0.000  6.333 2.202  6.048 2.186
bayesian      0.286 0.028  0.308 0.034  0.699 0.002  0.725 0.002  3.469 0.761  3.610 0.970
HMS           0.194 0.023  0.210 0.033  0.529 0.001  0.582 0.002  5.357 1.379  5.254 1.458
NEP-MLP       0.302 0.032  0.336 0.038  0.661 0.002  0.736 0.002  3.650 1.035  3.445 0.948
NEP-GCN       0.324 0.034  0.359 0.041  0.728 0.001  0.792 0.002  3.629 1.042  3.191 0.866
NEP-HEAT      0.351 0.033  0.391 0.041  0.724 0.002  0.783 0.002  3.570 1.032  3.186 0.910
oracle        0.454 0.039  0.475 0.063  0.932 0.002  0.939 0.002  3.001 0.772  2.921 0.764
"""


def _read_table_1() -> dict[str, dict[str, Number]]:
    """Return the numbers of each setting by row."""
    table: dict[str, dict[str, Number]] = {setting: {} for setting in _SETTINGS}
    for line in _TABLE_1.split("\n")[1:-1]:
        name, *numbers = line.split()
        for number, setting in enumerate(_SETTINGS):
            mean, std = numbers[2 * number : 2 * number + 2]
            table[setting][name] = float(mean), float(std)
    return table


# By name of the setting and by row, named as ours.
PAPER_TABLE_1: Mapping[str, Mapping[str, Number]] = _read_table_1()

# Table 2: Predict Object Location with dynamic nodes, by key of
# `nep.reproduce.experiments.ABLATIONS` (None: the full model) and by name of the model.
PAPER_TABLE_2: Mapping[str | None, Mapping[str, Number]] = {
    None: {"mlp": (0.302, 0.032), "gcn": (0.324, 0.034), "heat": (0.351, 0.033)},
    "no_prior": {"mlp": (0.260, 0.028), "gcn": (0.233, 0.024), "heat": (0.267, 0.029)},
    "no_transformer": {"mlp": (0.263, 0.028), "gcn": (0.310, 0.034), "heat": (0.314, 0.032)},
    "no_temporal": {"mlp": (0.288, 0.032), "gcn": (0.320, 0.033), "heat": (0.322, 0.031)},
    "no_semantic": {"mlp": (0.263, 0.027), "gcn": (0.322, 0.030), "heat": (0.328, 0.030)},
}
