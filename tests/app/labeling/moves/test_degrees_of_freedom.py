"""A drag's degrees of freedom follow from its poses alone."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.labeling.moves.degrees_of_freedom import degrees_of_freedom
from registration_core.geometry import pose

AXES = "xyz"
numbers = st.floats(-1.0, 1.0)
vectors = st.tuples(numbers, numbers, numbers).map(np.array)
poses = st.tuples(vectors, vectors).map(lambda parts: pose.exp(np.concatenate(parts)))
amounts = st.floats(0.005, 2.5).flatmap(lambda size: st.sampled_from([size, -size]))
axes = st.integers(0, 2)


def about(pivot: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """A motion in the axes of a gizmo that stands at `pivot` on the object, as a pose of the object."""
    T_object_gizmo = pose.from_rotation_translation(np.eye(3), pivot)
    return T_object_gizmo @ motion @ pose.inverse(T_object_gizmo)


def shift(axis: int, amount: float) -> np.ndarray:
    twist = np.zeros(6)
    twist[axis] = amount
    return pose.exp(twist)


def turn(axis: int, amount: float) -> np.ndarray:
    return shift(axis + 3, amount)


@given(poses, vectors)
def test_no_motion_uses_none(T, pivot):
    assert degrees_of_freedom(T, T, pivot) == ()


@given(poses, vectors, axes, amounts)
def test_an_arrow_is_one_translation(T, pivot, axis, amount):
    moved = T @ about(pivot, shift(axis, amount))
    assert degrees_of_freedom(T, moved, pivot) == (f"t{AXES[axis]}",)


@given(poses, vectors, axes, amounts)
def test_an_arc_is_one_rotation_wherever_the_pivot_is(T, pivot, axis, amount):
    moved = T @ about(pivot, turn(axis, amount))
    assert degrees_of_freedom(T, moved, pivot) == (f"r{AXES[axis]}",)


@given(poses, vectors, st.sampled_from([(0, 1), (0, 2), (1, 2)]), amounts, amounts)
def test_a_square_is_two_translations(T, pivot, plane, first, second):
    moved = T @ about(pivot, shift(plane[0], first) @ shift(plane[1], second))
    assert degrees_of_freedom(T, moved, pivot) == tuple(f"t{AXES[axis]}" for axis in plane)


@given(poses, vectors, vectors, vectors)
def test_any_motion_uses_exactly_the_components_that_are_not_rounding(T, pivot, translation, rotation):
    translation = np.where(np.abs(translation) < 2e-4, 0.0, translation)
    rotation = np.where(np.abs(rotation) < 2e-3, 0.0, rotation)
    moved = T @ about(pivot, pose.exp(np.concatenate([translation, rotation])))
    expected = [f"t{a}" for a, v in zip(AXES, translation, strict=True) if v]
    expected += [f"r{a}" for a, v in zip(AXES, rotation, strict=True) if v]
    assert degrees_of_freedom(T, moved, pivot) == tuple(expected)


@given(poses, poses, poses, vectors)
def test_the_frame_in_which_both_poses_are_given_does_not_matter(T_world_other, T_start, T_end, pivot):
    here = degrees_of_freedom(T_start, T_end, pivot)
    assert degrees_of_freedom(T_world_other @ T_start, T_world_other @ T_end, pivot) == here


@given(poses, vectors, axes)
def test_rounding_on_the_way_through_the_browser_is_no_motion(T, pivot, axis):
    moved = T @ about(pivot, shift(axis, 5e-5) @ turn(axis, 5e-4))
    assert degrees_of_freedom(T, moved, pivot) == ()


def test_a_turn_about_the_pivot_seen_from_another_pivot_moves_too():
    moved = about(np.array([0.1, 0.0, 0.0]), turn(2, 0.5))
    assert degrees_of_freedom(np.eye(4), moved, np.zeros(3)) == ("tx", "ty", "rz")


@pytest.mark.parametrize("angle", [np.pi - 1e-6, -np.pi + 1e-6])
def test_half_a_turn_is_still_one_rotation(angle):
    assert degrees_of_freedom(np.eye(4), turn(1, angle), np.zeros(3)) == ("ry",)


@given(poses, vectors, axes, amounts)
def test_a_gizmo_in_the_worlds_axes_moves_along_and_turns_about_them(T, pivot, axis, amount):
    centre = pose.from_rotation_translation(np.eye(3), pose.apply(T, pivot))
    for letter, motion in (("t", shift(axis, amount)), ("r", turn(axis, amount))):
        moved = centre @ motion @ pose.inverse(centre) @ T
        assert degrees_of_freedom(T, moved, pivot, "world") == (f"{letter}{AXES[axis]}",)
