"""The same operator, the same task, two conditions."""

import pytest

from app.analysis.statistics.comparison import comparisons
from app.analysis.statistics.curves import Timing
from tests.app.analysis.trials import trial

TRIALS = [
    trial([0.1, 0.1, 0.02], operator="P1"),  # 1 s
    trial([0.1, 0.01], operator="P1", condition="snap"),  # 0.5 s
    trial([0.1] * 4 + [0.03], operator="P2"),  # 2 s
    trial([0.1, 0.01], operator="P2", condition="snap"),  # 0.5 s
    trial([0.1] * 9, operator="P3"),  # did it one way only
    trial([0.1, 0.01], operator="P2", scene="shelf", condition="snap"),  # and this scene, too
    trial([0.1, 0.01], operator="P1", mode="quick", condition="three points"),
]


def test_pairs_are_compared_operator_by_operator():
    (found,) = comparisons(TRIALS, Timing(), seed=0)
    assert (found.group, found.mode, found.first, found.second) == ("novice", "accurate", "manual", "snap")
    assert (found.pairs, found.seconds.operators) == (2, 2)
    assert found.seconds.mean == pytest.approx(-1.0)  # -0.5 s and -1.5 s
    assert (found.seconds.low, found.seconds.high) == pytest.approx((-1.5, -0.5))
    assert found.translation.mean == pytest.approx(-0.015)


def test_each_group_is_compared_alone_and_all_of_them_together():
    expert = [
        trial([0.1] * 5, operator="E1", group="expert"),  # 2 s
        trial([0.1], operator="E1", group="expert", condition="snap"),  # at once
    ]
    found = comparisons([*TRIALS, *expert], Timing(), seed=0)
    assert [(one.group, one.pairs) for one in found] == [("novice", 2), ("expert", 1), ("all groups", 3)]
    assert [one.seconds.mean for one in found] == pytest.approx([-1.0, -2.0, -4.0 / 3.0])


def test_all_conditions_are_compared_with_each_other():
    techniques = [trial([0.1], condition=name) for name in ("three points", "manual", "find it")]
    pairs = [(found.first, found.second) for found in comparisons(techniques, Timing(), seed=0)]
    assert pairs == [("manual", "find it"), ("manual", "three points"), ("find it", "three points")]
