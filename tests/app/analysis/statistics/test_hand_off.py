"""Where the curves part, in cases worked out by hand."""

import numpy as np

from app.analysis.statistics.hand_off import hand_off
from tests.app.analysis.trials import NAN

MARGINS = np.array([0.1, 0.05, 0.02, 0.01])
OPERATORS = ["P1", "P2"]
STG = np.array([[0.1, 0.1, 0.1, 0.1], [0.1, 0.1, 0.1, 0.1]])


def test_the_curves_part_at_the_largest_margin_from_which_on_a_snap_saves_time():
    human = np.array([[0.0, 1.1, 3.1, NAN], [0.0, 2.1, 4.1, NAN]])
    point = hand_off(human, STG, OPERATORS, MARGINS, seed=0)
    assert point is not None
    assert (point.margin, point.best_margin, point.operators) == (0.05, 0.02, 2)
    assert not point.is_largest
    assert np.isclose(point.saved, 3.5) and np.allclose(point.saved_interval, (3.0, 4.0))


def test_a_gain_that_is_not_sure_ends_the_way_up():
    human = np.array([[5.0, 0.0, 3.1, 4.1], [5.0, 2.1, 4.1, 5.1]])  # at 0.05 one of two loses time
    point = hand_off(human, STG, OPERATORS, MARGINS, seed=0)
    assert point is not None and point.margin == 0.1 and point.is_largest  # most is saved there
    human[:, 0] = 1.0
    point = hand_off(human, STG, OPERATORS, MARGINS, seed=0)
    assert point is not None and (point.margin, point.best_margin) == (0.02, 0.01)


def test_much_that_is_saved_by_one_alone_hides_nothing_that_is_sure():
    human = np.array([[0.0, 1.1, 3.1, 99.1], [0.0, 2.1, 4.1, 0.0]])  # at 0.01 one of two loses time
    point = hand_off(human, STG, OPERATORS, MARGINS, seed=0)
    assert point is not None and (point.margin, point.best_margin) == (0.05, 0.02)


def test_margins_that_few_reach_do_not_count():
    few = [NAN] * 3
    human = np.array(
        [[2.1] * 5, [3.1, 3.2, 3.3, 3.4, 3.5], [9.1, 0.0, *few], [99.1, 99.2, *few]]
    ).T  # at 0.02 one of two loses time
    point = hand_off(human, np.full((5, 4), 0.1), ["P1", "P2", "P3", "P4", "P5"], MARGINS, seed=0)
    assert point is not None
    assert (point.margin, point.best_margin, point.operators) == (0.1, 0.05, 5)


def test_only_trials_that_come_there_both_ways_are_compared():
    human = np.array([[9.0, 9.0, NAN, NAN], [9.0, 9.0, 9.0, NAN]])
    point = hand_off(human, np.where(np.isnan(human), STG, NAN), OPERATORS, MARGINS, seed=0)
    assert point is None


def test_where_a_snap_saves_nothing_there_is_no_point():
    assert hand_off(np.zeros((2, 4)), STG, OPERATORS, MARGINS, seed=0) is None
    assert hand_off(np.full((1, 4), 9.0), STG[:1], ["P1"], MARGINS, seed=0) is None  # one operator
