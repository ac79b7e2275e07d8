"""Group laws of poses and what is refused as one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import ArrayLike

from registration_core.geometry import pose

twists = arrays(np.float64, 6, elements=st.floats(-1.7, 1.7))
points = arrays(np.float64, (5, 3), elements=st.floats(-3, 3))


@given(twists)
def test_inverse_undoes(twist) -> None:
    T = pose.exp(twist)
    np.testing.assert_allclose(pose.inverse(T) @ T, np.eye(4), atol=1e-12)
    np.testing.assert_allclose(T @ pose.inverse(T), np.eye(4), atol=1e-12)


@given(twists, twists, twists)
def test_composition_is_associative_and_inverts_in_reverse(a, b, c) -> None:
    A, B, C = pose.exp(a), pose.exp(b), pose.exp(c)
    np.testing.assert_allclose((A @ B) @ C, A @ (B @ C), atol=1e-12)
    np.testing.assert_allclose(pose.inverse(A @ B), pose.inverse(B) @ pose.inverse(A), atol=1e-12)


@given(twists, twists, points)
def test_apply_follows_composition(a, b, p) -> None:
    A, B = pose.exp(a), pose.exp(b)
    np.testing.assert_allclose(pose.apply(A @ B, p), pose.apply(A, pose.apply(B, p)), atol=1e-11)


@given(twists)
def test_log_inverts_exp_below_a_half_turn(twist) -> None:
    np.testing.assert_allclose(pose.log(pose.exp(twist)), twist, atol=1e-7)


@given(twists, st.floats(0, 0.5), st.floats(1e-6, 3.1), st.integers(0, 1000))
def test_perturbed_moves_by_exactly_that_much(twist, translation, rotation, seed) -> None:
    T = pose.exp(twist)
    apart = pose.distance(T, pose.perturbed(T, translation, rotation, np.random.default_rng(seed)))
    assert apart.translation == pytest.approx(translation, abs=1e-9)
    assert apart.rotation == pytest.approx(rotation, abs=1e-7)


@given(twists, twists)
def test_distance_is_symmetric_and_zero_at_home(a, b) -> None:
    A, B = pose.exp(a), pose.exp(b)
    assert pose.distance(A, B) == pytest.approx(pose.distance(B, A), abs=1e-9)
    assert pose.distance(A, A) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_rotation_angle_of_a_half_turn() -> None:
    assert pose.rotation_angle(np.diag([1.0, -1.0, -1.0])) == pytest.approx(np.pi)


@given(twists)
def test_mean_of_opposite_moves_is_the_middle(twist) -> None:
    half = pose.exp(twist / 4), pose.exp(-twist / 4)
    np.testing.assert_allclose(pose.mean(np.stack(half)), np.eye(4), atol=1e-9)


def test_mean_follows_the_weights() -> None:
    T = np.stack([pose.exp([0, 0, 0, 0, 0, 0]), pose.exp([1, 0, 0, 0, 0, 0])])
    np.testing.assert_allclose(pose.mean(T, [1, 3])[:3, 3], [0.75, 0, 0])


@given(twists)
def test_checked_removes_rounding(twist) -> None:
    T = pose.exp(twist)
    rounded = T.astype(np.float32).astype(np.float64)
    checked = pose.checked(rounded, "T")
    np.testing.assert_allclose(checked[:3, :3] @ checked[:3, :3].T, np.eye(3), atol=1e-13)
    np.testing.assert_allclose(checked, T, atol=1e-5)


BROKEN: dict[str, ArrayLike] = {
    "of numbers": [["a"] * 4] * 4,
    "shape": np.eye(3),
    "NaN": np.full((4, 4), np.nan),
    "last row": np.diag([1.0, 1.0, 1.0, 2.0]),
    "scales": np.diag([2.0, 1.0, 1.0, 1.0]),
    "reflection": np.diag([-1.0, 1.0, 1.0, 1.0]),
}


@pytest.mark.parametrize("what", BROKEN)
def test_checked_names_the_argument_and_the_fault(what) -> None:
    with pytest.raises(ValueError, match=f"start_pose.*{what}"):
        pose.checked(BROKEN[what], "start_pose")
