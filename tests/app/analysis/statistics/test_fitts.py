"""Fitts' law is found in times that follow it."""

import numpy as np
import pytest

from app.analysis.statistics.curves import curve_of
from app.analysis.statistics.fitts import fitts
from tests.app.analysis.trials import NAN

MARGINS = np.array([0.4, 0.2, 0.1, 0.05, 0.025])
DISTANCE = 0.35


def times(a: float, b: float) -> np.ndarray:
    return a + b * np.log2(DISTANCE / MARGINS + 1.0)


def test_a_line_is_found_exactly_with_the_interval_over_operators():
    curve = curve_of(np.array([times(0.5, 0.2), times(0.7, 0.4)]), ["P1", "P2"], MARGINS, seed=0)
    line = fitts(curve, DISTANCE, seed=0)
    assert line is not None
    assert line.margins == 4  # a margin wider than the distance is no target
    assert (line.a, line.b, line.r_squared) == pytest.approx((0.6, 0.3, 1.0))
    assert line.throughput == pytest.approx(1 / 0.3)
    assert line.a_interval == pytest.approx((0.5, 0.7))
    assert line.b_interval == pytest.approx((0.2, 0.4))
    assert line.throughput_interval == pytest.approx((1 / 0.4, 1 / 0.2))


def test_margins_that_less_than_half_come_within_do_not_bend_it():
    rows = np.array([times(0.5, 0.3)] * 3)
    rows[0, 4] = 99.0
    rows[1:, 4] = NAN
    line = fitts(curve_of(rows, ["P1", "P2", "P3"], MARGINS, seed=0), DISTANCE, seed=0)
    assert line is not None and line.margins == 3 and line.b == pytest.approx(0.3)


def test_scatter_lowers_the_fit():
    bent = times(0.5, 0.3) + np.array([0.0, 0.0, 0.2, -0.2, 0.0])
    line = fitts(curve_of(bent[None], ["P1"], MARGINS, seed=0), DISTANCE, seed=0)
    assert line is not None and 0.2 < line.r_squared < 0.9
    assert np.isnan(line.a_interval).all()  # one operator says nothing of others


def test_too_few_margins_give_no_line_and_a_flat_one_no_throughput():
    rows = times(0.5, 0.3)[None]
    assert fitts(curve_of(rows, ["P1"], MARGINS, seed=0), 0.06, seed=0) is None
    flat = fitts(curve_of(np.full((1, 5), 2.0), ["P1"], MARGINS, seed=0), DISTANCE, seed=0)
    assert flat is not None and flat.b == 0.0 and np.isnan(flat.throughput) and np.isnan(flat.r_squared)
    up_and_down = curve_of(np.array([times(0.5, 0.3), times(0.5, -0.1)]), ["P1", "P2"], MARGINS, seed=0)
    line = fitts(up_and_down, DISTANCE, seed=0)
    assert line is not None and line.b == pytest.approx(0.1) and np.isnan(line.throughput_interval).all()
