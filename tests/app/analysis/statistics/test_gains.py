"""Errors before and after a snap."""

import numpy as np
import pytest

from app.analysis.statistics.gains import gains
from tests.app.analysis.trials import NAN, trial


def test_the_last_pose_and_the_whole_course_are_told_apart():
    trials = [
        trial([0.1, 0.02], [0.4, 0.2], [0.01, 0.01], [NAN, 0.1], operator="P1"),
        trial([0.1, 0.04], [0.6, 0.4], [0.01, 0.03], [0.2, 0.1], operator="P2"),
    ]
    found = {(gain.error, gain.moment): gain for gain in gains(trials, seed=0)}
    end = found["rotation", "at the end"]
    assert (end.before.mean, end.after.mean, end.gain.mean) == pytest.approx((0.3, 0.1, 0.2))
    assert (end.gain.low, end.gain.high) == pytest.approx((0.1, 0.3))
    assert end.improved == 1.0 and end.verdict == "a snap improves it"
    along = found["rotation", "all along"]  # P1 has one snap, P2 two: (0.1 + (0.4 + 0.3) / 2) / 2
    assert along.gain.mean == pytest.approx(0.225)
    assert found["translation", "at the end"].gain.mean == pytest.approx(0.01)


def test_a_gain_about_zero_and_a_loss_are_said():
    both = [
        trial([0.02], [0.1], [0.01], [0.2], operator="P1"),
        trial([0.01], [0.1], [0.02], [0.2], operator="P2"),
    ]
    found = {(gain.error, gain.moment): gain.verdict for gain in gains(both, seed=0)}
    assert found["translation", "at the end"] == "no difference can be shown"
    assert found["rotation", "at the end"] == "a snap worsens it"
    (alone, *_) = gains(both[:1], seed=0)
    assert alone.verdict.startswith("cannot be told")
    assert gains([trial([0.1, 0.2])], seed=0) == []


def test_no_snap_from_the_end_is_no_number():
    (end, *_) = gains([trial([0.1, 0.2], stg_translation=[0.1, NAN])], seed=0)
    assert end.trials == 0 and np.isnan(end.gain.mean) and np.isnan(end.improved)


def test_methods_are_compared_from_the_poses_that_both_have():
    one, other = (
        trial(
            [0.1, 0.04, 0.02], [0.5, 0.3, 0.2], [0.01] * 3, [0.1] * 3,
            paper_translation=[0.05, NAN, 0.01], paper_rotation=[0.6, NAN, 0.2], operator=code,
        )
        for code in ("P1", "P2")
    )  # fmt: skip
    found = {(gain.error, gain.moment, gain.method): gain for gain in gains([one, other], seed=0)}
    assert len(found) == 2 * 3 * 2
    for moment in ("all along", "from the same poses"):
        paper = found["rotation", moment, "paper"]
        assert (paper.before.mean, paper.after.mean) == pytest.approx((0.35, 0.4))
        assert paper.verdict == "a snap worsens it"
    assert "from the same poses, by the paper's filter: a snap worsens it;" in paper.sentence
    assert found["rotation", "all along", "default"].before.mean == pytest.approx(1.0 / 3.0)
    same = found["rotation", "from the same poses", "default"]
    assert (same.before.mean, same.gain.mean) == pytest.approx((0.35, 0.25))
    assert found["translation", "at the end", "paper"].gain.mean == pytest.approx(0.01)
