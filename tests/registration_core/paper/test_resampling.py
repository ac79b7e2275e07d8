"""Weights and systematic resampling."""

from typing import cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from registration_core.paper.resampling import normalised, systematic

log_weights = arrays(np.float64, st.integers(1, 60), elements=st.floats(-50, 50))


@given(log_weights, st.floats(-1e3, 1e3))
def test_normalised_sums_to_one_and_ignores_a_common_constant(values, constant) -> None:
    weights = normalised(values)
    assert weights.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(normalised(values + constant), weights, rtol=1e-6, atol=1e-12)


def test_particle_of_no_support_weighs_nothing() -> None:
    np.testing.assert_array_equal(normalised(np.array([-np.inf, 3.0])), [0.0, 1.0])


def test_all_without_support_weigh_the_same() -> None:
    np.testing.assert_array_equal(normalised(np.full(4, -np.inf)), np.full(4, 0.25))


@pytest.mark.parametrize("values", [[], [np.nan, 0.0], [np.inf, 0.0]])
def test_normalised_refuses_what_is_no_log_weight(values) -> None:
    with pytest.raises(ValueError, match="log_weights"):
        normalised(np.array(values, dtype=np.float64))


@given(log_weights, st.integers(1, 200), st.integers(0, 2**32))
def test_each_particle_is_drawn_as_often_as_its_weight_says(values, count, seed) -> None:
    weights = normalised(values)
    drawn = systematic(weights, np.random.default_rng(seed), count)
    assert len(drawn) == count
    often = np.bincount(drawn, minlength=len(weights))
    assert (often >= np.floor(count * weights - 1e-9)).all()
    assert (often <= np.ceil(count * weights + 1e-9)).all()


class Highest:
    """A generator that draws the largest number below 1."""

    def random(self) -> float:
        return np.nextafter(1.0, 0.0)


@pytest.mark.parametrize("size", [3, 7, 10, 49, 625])
def test_draw_beyond_a_sum_that_falls_short_of_one_stays_inside(size) -> None:
    weights = np.full(size, 1.0 / size) * (1.0 - 1e-12)
    assert systematic(weights, cast(np.random.Generator, Highest())).max() == size - 1
