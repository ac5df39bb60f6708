import numpy as np
import pytest

from simulator.tasks.metrics import compute_calibration_error, compute_nll


def test_calibration_error_by_hand():
    # Bin [0.2, 0.3): confidences 0.22 and 0.28, one of two right: |0.5 - 0.25| = 0.25, 2 answers.
    # Bin [0.9, 1.0]: 0.95 and 1.0, both right: |1 - 0.975| = 0.025, 2 answers.
    # Mean over the four answers: (2 * 0.25 + 2 * 0.025) / 4 = 0.1375.
    confidence = np.array([0.22, 0.95, 0.28, 1.0])
    is_correct = np.array([True, True, False, True])
    assert compute_calibration_error(confidence, is_correct) == pytest.approx(0.1375)
    # In one bin: mean confidence 0.6125, accuracy 0.75.
    assert compute_calibration_error(confidence, is_correct, 1) == pytest.approx(0.1375)
    assert np.isnan(compute_calibration_error(confidence[:0], is_correct[:0]))


def test_nll_by_hand():
    # -(ln 0.5 + ln 0.25) / 2 = 3 ln 2 / 2 = 1.0397208
    assert compute_nll(np.array([0.5, 0.25])) == pytest.approx(1.0397208)
    # What was held impossible costs -ln 1e-6 = 13.8155106.
    assert compute_nll(np.array([0.0])) == pytest.approx(13.8155106)
    assert np.isnan(compute_nll(np.zeros(0)))
