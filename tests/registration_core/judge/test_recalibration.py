"""Confidences corrected by experience: monotone, nothing without any, and right with much."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import expit, logit

from registration_core.judge.recalibration import Recalibration, recalibration


def experience(count: int, stretch: float, shift: float) -> tuple[np.ndarray, np.ndarray]:
    """Confidences whose true chance of being right has log-odds so much stretched and shifted."""
    rng = np.random.default_rng(3)
    confidences = rng.beta(2.0, 1.0, count)
    return confidences, rng.random(count) < expit(stretch * logit(confidences) + shift)


@pytest.mark.parametrize(("stretch", "shift"), [(1.0, 0.0), (0.5, -1.0), (2.0, 0.7)])
def test_much_experience_gives_the_truth(stretch: float, shift: float) -> None:
    confidences, right = experience(20_000, stretch, shift)
    found = recalibration(confidences, right, np.ones(len(right)))
    assert found.stretch == pytest.approx(stretch, rel=0.06)
    assert found.shift == pytest.approx(shift, abs=0.06)


def test_little_experience_changes_little() -> None:
    assert recalibration(np.empty(0), np.empty(0, dtype=bool), np.empty(0)) == Recalibration(1.0, 0.0)
    one = recalibration(np.array([0.9]), np.array([False]), np.ones(1))
    many = recalibration(np.full(50, 0.9), np.zeros(50, dtype=bool), np.ones(50))
    assert 0.5 < one(0.9) < 0.9
    assert many(0.9) < 0.2


def test_a_result_that_counts_half_counts_as_half_of_one() -> None:
    confidences, right = experience(60, 0.5, -1.0)
    twice = recalibration(np.repeat(confidences, 2), np.repeat(right, 2), np.full(120, 0.5))
    once = recalibration(confidences, right, np.ones(60))
    assert twice.stretch == pytest.approx(once.stretch, abs=1e-3)
    assert twice.shift == pytest.approx(once.shift, abs=1e-3)


@given(st.floats(0.05, 5.0), st.floats(-5.0, 5.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_order_is_kept_and_results_are_probabilities(stretch, shift, a, b) -> None:
    low, high = Recalibration(stretch, shift)(sorted([a, b]))
    assert 0.0 <= low <= high <= 1.0


def test_without_correction_a_confidence_stays() -> None:
    known = np.linspace(0.001, 0.999, 50)
    np.testing.assert_allclose(Recalibration()(known), known)
