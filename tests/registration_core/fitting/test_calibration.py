"""Probabilities from what speaks for a winner: known answers."""

import numpy as np
import pytest
from scipy.special import expit

from registration_core.fitting.calibration import (
    FREE,
    auroc,
    calibration_error,
    doubt,
    log_loss,
    logistic_weights,
)
from registration_core.judge.confidence import FEATURES


def test_logistic_weights_are_found_and_negative_only_where_they_may_be() -> None:
    rng = np.random.default_rng(0)
    features = np.column_stack([np.ones(20_000), rng.normal(size=(20_000, len(FEATURES) - 1))])
    truth = np.zeros(len(FEATURES))
    truth[[0, 1, 2, 3, FEATURES.index("color")]] = -1.0, 2.0, 0.5, -1.0, -0.7
    right = rng.random(20_000) < expit(features @ truth)
    weights = logistic_weights(features, right, ridge=1e-6)
    assert weights[1] == pytest.approx(2.0, abs=0.4)  # less, since the third weight cannot be negative
    assert weights[3] == 0.0
    assert weights[FEATURES.index("color")] == pytest.approx(-0.7, abs=0.3)
    assert all(weight >= 0.0 for name, weight in zip(FEATURES, weights, strict=True) if name not in FREE)


def test_area_under_the_curve() -> None:
    right = np.array([True, True, False, False])
    assert auroc(np.array([0.9, 0.8, 0.2, 0.1]), right) == 1.0
    assert auroc(np.array([0.1, 0.2, 0.8, 0.9]), right) == 0.0
    assert auroc(np.full(4, 0.5), right) == 0.5


def test_calibration_error_and_log_loss_of_honest_claims_are_small() -> None:
    rng = np.random.default_rng(1)
    claims = rng.random(50_000)
    right = rng.random(50_000) < claims
    assert calibration_error(claims, right) < 0.01
    assert calibration_error(np.sqrt(claims), right) > 0.1
    assert log_loss(claims, right) < log_loss(np.sqrt(claims), right)


def test_a_round_is_left_out_only_where_it_would_gain_next_to_nothing() -> None:
    confidence = np.linspace(0.0, 1.0, 1001)
    now = confidence > 0.6
    after = np.ones(1001, np.bool_)  # the round would mend all below 0.6
    assert doubt(confidence, now, after, lost=0.001) == pytest.approx(0.6, abs=0.005)
    assert doubt(confidence, after, after, lost=0.001) == 0.0
