"""Axes of symmetries, read off transforms and checked before they are made into some."""

import numpy as np
import pytest
import trimesh

from registration_core import Symmetries, SymmetryAxis, as_symmetries, axes_of, check_axes, residual_of
from registration_core.geometry.object_model import ContinuousSymmetry
from tests.registration_core.simple_scene import model_of

X, Y, Z = np.eye(3)
MIDDLE = np.array([0.1, -0.02, 0.03])
BOX = model_of(trimesh.creation.box([0.04, 0.06, 0.06]).apply_translation(MIDDLE))


def about(axis, fold: int | None, origin=MIDDLE) -> SymmetryAxis:
    return SymmetryAxis(np.asarray(axis) / np.linalg.norm(axis), np.asarray(origin), fold)


@pytest.mark.parametrize(
    "axes",
    [
        [],
        [about([1, 2, -1], 2)],
        [about([1, 2, -1], 3)],
        [about(Z, 12)],
        [about(Z, 24)],
        [about(X, 2), about(Y, 2), about(Z, 2)],
        [about(Z, None)],
        [about(Z, None), about(X, 2)],
        [about(X, None), about(Y, None), about(Z, None)],
    ],
    ids=lambda axes: "+".join(str(axis.fold) for axis in axes),
)
def test_symmetries_are_those_of_their_axes(axes) -> None:
    symmetries = as_symmetries(axes)
    found = axes_of(symmetries)
    assert [axis.fold for axis in found] == [axis.fold for axis in axes]
    for one, other in zip(found, axes, strict=True):
        assert abs(one.axis @ other.axis) == pytest.approx(1.0)
        assert np.linalg.norm(np.cross(one.origin - other.origin, other.axis)) < 1e-9
    before, after = symmetries.transforms(0.1), as_symmetries(found).transforms(0.1)
    assert len(before) == len(after)
    apart = np.abs(before[:, None] - after).max(axis=(2, 3)).min(axis=1)
    assert apart.max() < 1e-9 or any(axis.fold is None for axis in axes)


def test_a_cube_has_all_its_axes() -> None:
    axes = axes_of(as_symmetries([about([1, 1, 1], 3), about(Z, 4)]))
    assert sorted(axis.fold for axis in axes if axis.fold) == [2] * 6 + [3] * 4 + [4] * 3


def test_numbers_of_an_older_dataset_are_read_as_the_fold_that_is_nearest() -> None:
    (axis,) = axes_of(as_symmetries([about(Z, 5)]))
    assert axis.fold == 5
    third = np.eye(4)
    third[:2, :2] = [[-0.5, -0.866], [0.866, -0.5]]  # rounded
    (axis,) = axes_of(Symmetries(discrete=(tuple(map(tuple, third)),)))
    assert axis.fold == 3


def test_the_identity_is_no_axis_and_directions_need_no_length() -> None:
    identity = tuple(map(tuple, np.eye(4)))
    around = ContinuousSymmetry((0.0, 0.0, 5.0), (0.1, 0.0, 0.0))
    (axis,) = axes_of(Symmetries(discrete=(identity,), continuous=(around,)))
    assert np.array_equal(axis.axis, Z) and np.array_equal(axis.origin, [0.1, 0.0, 0.0])


@pytest.mark.parametrize(
    ("axes", "message"),
    [
        ([about(Z, 2, [30.0, 0, 0])], r"axes\[0\] passes 2.99e\+04 mm from the middle of the object"),
        ([about(X, 2), about(-X, 4)], r"axes\[0\] and axes\[1\] have one direction"),
        (
            [about(X, 2), about(Z, 2), about(Y, 2, MIDDLE + 0.01 * X)],
            r"axes\[1\] and axes\[2\] pass each other by 10 mm",
        ),
        ([about(X, None), about(Y, 4)], r"axes\[1\] does not go with axes\[0\], which turns by any angle"),
        ([about([1, 1, 0], 2), about(Y, None)], r"axes\[0\] does not go with axes\[1\]"),
        ([about(X, None), about(Y, None), about(Z, 2)], r"axes\[2\] does not go with axes\[0\]"),
    ],
)
def test_axes_that_do_not_go_together_are_named(axes, message) -> None:
    with pytest.raises(ValueError, match=message):
        check_axes(axes, BOX)


def test_axes_that_go_together_pass() -> None:
    for axes in ([], [about(X, 4), about(Y, 2)], [about(X, None), about(Y, 2)], [about(X, None)]):
        check_axes(axes, BOX)


def test_the_residual_of_an_axis_is_how_far_the_surface_misses_itself() -> None:
    assert residual_of(BOX, about(X, 4)) < 1e-5
    assert residual_of(BOX, about(Y, 2)) < 1e-5
    # a quarter turn about y puts 40 mm where 60 mm were
    assert residual_of(BOX, about(Y, 4)) == pytest.approx(0.01, rel=0.02)
    assert residual_of(BOX, about(X, 4, MIDDLE + 0.005 * Y)) == pytest.approx(0.01, rel=0.02)
