"""Curves of traces that can be worked out on paper."""

import numpy as np
import pytest

from app.analysis.statistics.curves import MARGINS, Timing, curve_of, first_within, human_times, stg_times
from tests.app.analysis.trials import NAN, trial

TWO_MARGINS = np.array([0.05, 0.01])


def at_margin(times: np.ndarray, metres: float) -> float:
    """The time of the only trial at the grid's margin nearest to this."""
    return times[0, np.abs(MARGINS["translation"] - metres).argmin()]


def test_the_first_time_within_a_margin_counts_even_where_the_pose_leaves_it_again():
    seconds = np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    errors = np.array([0.1, 0.05, 0.08, 0.02, 0.03])
    found = first_within(seconds, errors, np.array([0.2, 0.1, 0.06, 0.05, 0.02, 0.01]))
    assert found == pytest.approx([0.0, 0.0, 0.5, 0.5, 1.5, NAN], nan_ok=True)


def test_an_error_that_is_unknown_is_within_no_margin():
    found = first_within(np.array([0.0, 0.5, 1.0]), np.array([NAN, 0.1, NAN]), np.array([0.2, 0.05]))
    assert found == pytest.approx([0.5, NAN], nan_ok=True)
    assert np.isnan(first_within(np.array([0.0]), np.array([NAN]), np.array([np.inf, 1.0]))).tolist() == [
        False,
        True,
    ]


def test_a_snap_counts_from_where_it_was_asked_for_with_its_seconds():
    one = trial([0.09, 0.06, 0.02], stg_translation=[0.04, NAN, 0.0015])
    timing = Timing(snap_seconds=0.25)
    assert at_margin(human_times([one], "translation", timing), 0.05) == 1.0
    assert at_margin(stg_times([one], "translation", timing), 0.05) == 0.25
    assert at_margin(stg_times([one], "translation", timing), 0.002) == 1.25
    assert np.isnan(at_margin(stg_times([one], "translation", timing), 0.001))


def test_idle_time_can_be_left_out():
    one = trial([0.09, 0.09, 0.09, 0.02], idle_seconds=1.0)
    assert at_margin(human_times([one], "translation", Timing()), 0.05) == 1.5
    assert at_margin(human_times([one], "translation", Timing(without_idle=True)), 0.05) == 0.5


def test_an_operator_counts_once_however_many_trials():
    # P1: 2 s and 4 s, mean 3 s; P2: 6 s. At the second margin P1 has one of two trials, P2 none.
    times = np.array([[2.0, NAN], [6.0, NAN], [4.0, 7.0]])
    curve = curve_of(times, ["P1", "P2", "P1"], TWO_MARGINS, seed=0)
    assert curve.mean == pytest.approx([4.5, 7.0])
    assert curve.operators.tolist() == [2, 1]
    assert curve.trials.tolist() == [3, 1]
    assert curve.share == pytest.approx([1.0, 0.25])  # (1/2 + 0) / 2
    assert curve.typical.tolist() == [2, 2]  # 4 s is nearest to 4.5 s
    # means of two operators drawn from two: 3, 4.5 and 6 s, in 1, 2 and 1 of 4 cases
    assert (curve.low[0], curve.high[0]) == (3.0, 6.0)
    assert np.isnan([curve.low[1], curve.high[1]]).all()


def test_nobody_who_comes_within_a_margin_is_said_and_no_number():
    curve = curve_of(np.full((2, 2), NAN), ["P1", "P2"], TWO_MARGINS, seed=0)
    assert np.isnan(curve.mean).all() and np.isnan(curve.low).all()
    assert curve.share.tolist() == [0.0, 0.0] and curve.typical.tolist() == [-1, -1]


def test_a_curve_does_not_hang_on_the_order_of_trials_and_repeats_with_its_seed():
    rng = np.random.default_rng(5)
    times, operators = rng.uniform(0, 10, (20, 2)), [f"P{i % 7}" for i in range(20)]
    order = rng.permutation(20)
    one = curve_of(times, operators, TWO_MARGINS, seed=3)
    other = curve_of(times[order], [operators[i] for i in order], TWO_MARGINS, seed=3)
    assert np.allclose(one.mean, other.mean) and np.allclose(one.low, other.low)
    assert (one.low < one.mean).all() and (one.mean < one.high).all()


def test_intervals_hold_the_true_mean_about_as_often_as_they_say():
    rng = np.random.default_rng(1)
    held = 0
    for study in range(200):
        times = rng.normal(5.0, 1.0, (30, 1))
        curve = curve_of(times, [str(i) for i in range(30)], TWO_MARGINS[:1], seed=study)
        held += curve.low[0] <= 5.0 <= curve.high[0]
    assert 0.88 <= held / 200 <= 0.99
