"""The threshold of the confidence: its promise holds, and where nothing can be promised it says never."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from registration_core.judge.acceptance import (
    ENOUGH_FOR_STARTS,
    NEVER,
    Calibration,
    acceptance,
    calibration_of,
    shipped_calibration,
)

RISKS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)


def drawn(rng: np.random.Generator, count: int, chance_of_right) -> Calibration:
    """Estimates whose confidence c, uniform, is right with `chance_of_right(c)`."""
    confidences = rng.random(count)
    return calibration_of(confidences, rng.random(count) < chance_of_right(confidences), "drawn")


def risk_from(threshold: float, chance_of_right) -> float:
    """Share of wrong ones among all whose confidence, uniform, reaches the threshold."""
    return float(np.mean(1.0 - chance_of_right(np.linspace(threshold, 1.0, 10_001))))


@pytest.mark.parametrize("count", [150, 400, 2_000])
@pytest.mark.parametrize(
    "chance_of_right",
    [
        lambda c: np.clip(1.04 * c**0.1, 0, 1),
        lambda c: np.where(c > 0.97, 0.9, np.where(c > 0.3, 0.995, 0.5)),  # surest where it is wrong
        lambda c: np.full_like(c, 0.98),  # right at the limit everywhere
        lambda c: np.full_like(c, 0.97),
    ],
)
def test_the_bound_holds_in_all_but_a_share_delta_of_draws(count: int, chance_of_right) -> None:
    rng = np.random.default_rng(0)
    risk, draws = 0.02, 1_000
    thresholds = [acceptance(risk, drawn(rng, count, chance_of_right)) for _ in range(draws)]
    broken = sum(t <= 1.0 and risk_from(t, chance_of_right) > risk + 1e-9 for t in thresholds)
    slack = 3.0 * np.sqrt(0.1 * 0.9 * draws)
    assert broken <= 0.1 * draws + slack


def test_many_good_estimates_are_accepted() -> None:
    """Where a threshold exists that meets the risk, it is nearly found."""
    rng = np.random.default_rng(1)
    calibration = drawn(rng, 5_000, lambda c: np.where(c > 0.3, 0.995, 0.5))
    assert calibration.accepted_share(acceptance(0.02, calibration)) > 0.65


def test_errors_at_the_very_top_cost_one_sequence_only() -> None:
    confidences = np.linspace(0.0, 1.0, 2_001)
    right = np.ones(2_001, dtype=bool)
    right[-5:] = False
    assert acceptance(0.02, calibration_of(confidences, right, "")) == 0.0
    few = slice(-ENOUGH_FOR_STARTS + 1, None)
    assert acceptance(0.02, calibration_of(confidences[few], right[few], "")) == NEVER


@given(st.integers(0, 1_500), st.floats(0.0, 0.1), st.integers(0, 2**32 - 1))
def test_more_risk_accepts_no_less(count: int, wrong: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    calibration = drawn(rng, count, lambda c: np.clip(1.0 - wrong + 0.1 * (c - 0.5), 0.0, 1.0))
    thresholds = [acceptance(risk, calibration) for risk in RISKS]
    assert thresholds == sorted(thresholds, reverse=True)
    assert all(0.0 <= t <= 1.0 or t == NEVER for t in thresholds)


@given(st.lists(st.tuples(st.sampled_from([0.2, 0.5, 0.7, 0.9]), st.booleans()), min_size=1, max_size=600))
def test_order_of_the_estimates_does_not_matter(pairs) -> None:
    confidences, right = map(np.array, zip(*pairs, strict=True))
    there = calibration_of(confidences, right, "")
    back = calibration_of(confidences[::-1], right[::-1], "")
    assert acceptance(0.1, there) == acceptance(0.1, back)


def test_too_few_estimates_bear_out_no_threshold() -> None:
    enough = 114  # log 0.1 / log 0.98
    for count, expected in ((0, NEVER), (1, NEVER), (enough - 1, NEVER), (enough, 0.0)):
        calibration = calibration_of(np.linspace(0.1, 0.9, count), np.ones(count, dtype=bool), "")
        assert acceptance(0.02, calibration) == expected
    assert NEVER > 1.0


def test_a_threshold_keeps_out_what_was_not_tested() -> None:
    """The first one that is not accepted lies below the threshold, with all that are tied with it."""
    confidences = np.concatenate([np.linspace(0.8, 1.0, 200), np.full(50, 0.5)])
    right = np.concatenate([np.ones(200, dtype=bool), np.zeros(50, dtype=bool)])
    threshold = acceptance(0.02, calibration_of(confidences, right, ""))
    assert 0.5 < threshold <= 0.8


@pytest.mark.parametrize(
    ("confidences", "right", "delta", "named"),
    [
        ([0.5, 1.5], [1, 0], 0.1, "confidences"),
        ([np.nan], [1], 0.1, "confidences"),
        ([[0.5]], [[1]], 0.1, "confidences"),
        ([0.5], [1, 0], 0.1, "right"),
        ([0.5], [0.5], 0.1, "right"),
        ([0.5], [1], 1.0, "delta"),
    ],
)
def test_a_bad_calibration_is_refused(confidences, right, delta, named: str) -> None:
    with pytest.raises(ValueError, match=named):
        calibration_of(confidences, right, "", delta)


@pytest.mark.parametrize("risk", [0.0, 1.0, -0.1, float("nan")])
def test_a_risk_that_is_no_share_is_refused(risk: float) -> None:
    with pytest.raises(ValueError, match="risk"):
        acceptance(risk)


def test_shipped_calibration_is_read_from_the_fitted_numbers(tmp_path) -> None:
    assert acceptance(0.02, shipped_calibration(tmp_path / "none.json")) == NEVER
    stored = {"confidence": [0.9] * 200, "right": [True] * 200, "source": "two hundred", "delta": 0.05}
    path = tmp_path / "fitted.json"
    path.write_text(json.dumps({"calibration": stored}))
    known = shipped_calibration(path)
    assert (len(known), known.source, known.delta) == (200, "two hundred", 0.05)
    assert acceptance(0.02, known) == 0.0
    assert acceptance(0.02) == acceptance(0.02, shipped_calibration())
