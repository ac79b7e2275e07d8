"""What suggested axes amount to: closed groups, BOP's continuous and discrete parts, contradictions."""

import numpy as np
import pytest

from registration_core import SuggestedSymmetry, as_symmetries
from registration_core.geometry import pose

X, Y, Z = np.eye(3)
GOLDEN = (1.0 + np.sqrt(5.0)) / 2.0


def about(axis, fold: int | None, origin=(0.0, 0.0, 0.0)) -> SuggestedSymmetry:
    axis = np.asarray(axis, dtype=np.float64)
    return SuggestedSymmetry(axis / np.linalg.norm(axis), np.asarray(origin), fold, residual=0.0)


@pytest.mark.parametrize("fold", [2, 3, 5, 12])
def test_a_discrete_axis_turns_by_every_share_of_a_full_turn(fold) -> None:
    suggestion = about([1.0, 2.0, -1.0], fold, origin=[0.1, 0.0, 0.3])
    assert suggestion.transforms.shape == (fold - 1, 4, 4)
    generator = suggestion.transforms[0]
    assert pose.rotation_angle(generator[:3, :3]) == pytest.approx(2.0 * np.pi / fold)
    np.testing.assert_allclose(np.linalg.matrix_power(generator, fold), np.eye(4), atol=1e-12)
    for k, T in enumerate(suggestion.transforms, start=1):
        np.testing.assert_allclose(T, np.linalg.matrix_power(generator, k), atol=1e-12)
        np.testing.assert_allclose(pose.apply(T, suggestion.origin), suggestion.origin, atol=1e-12)


def test_the_turns_of_a_continuous_axis_fall_everywhere() -> None:
    transforms = about(Z, None).transforms
    angles = np.arctan2(transforms[:, 1, 0], transforms[:, 0, 0])
    for fold in range(1, 13):  # they would tell a polygon of any number of sides from a circle
        shares = np.sort(np.mod(angles * fold / (2.0 * np.pi), 1.0))
        assert np.diff(shares, append=shares[0] + 1.0).max() < 0.25


@pytest.mark.parametrize(
    ("suggestions", "rotations"),
    [
        ([], 1),
        ([about(Y, 3)], 3),
        ([about(X, 2), about(Y, 2)], 4),
        ([about(Z, 6), about(X, 2)], 12),
        ([about(Z, 12), about(X, 2)], 24),
        ([about([1, 1, 1], 3), about(Z, 2)], 12),
        ([about([1, 1, 1], 3), about(Z, 4)], 24),
        ([about([1, 1, 1], 3), about([0, 1, GOLDEN], 5)], 60),
    ],
)
def test_every_rotation_that_can_be_composed_is_there_once(suggestions, rotations) -> None:
    symmetries = as_symmetries(suggestions)
    assert symmetries.continuous == ()
    group = symmetries.transforms(diameter=1.0)
    assert len(group) == rotations
    for a in group:
        apart = np.abs((a @ group)[:, None] - group).max(axis=(2, 3))
        assert apart.min(axis=1).max() < 1e-9
        assert np.count_nonzero(apart < 1e-9) == rotations


def test_the_group_turns_about_the_common_point_of_its_axes() -> None:
    middle = np.array([0.1, -0.2, 0.3])
    symmetries = as_symmetries([about(Z, 4, middle), about([1, 1, 1], 3, middle)])
    for T in symmetries.transforms(diameter=1.0):
        np.testing.assert_allclose(pose.apply(T, middle), middle, atol=1e-12)


def test_what_was_measured_stays_as_it_was_measured() -> None:
    """Axes found on a scan are a little skewed; products of two only supply what was not found."""
    skewed = [about([1.0, 0.02, 0.0], 2), about([0.0, 1.0, -0.03], 2), about([0.01, 0.0, 1.0], 2)]
    transforms = as_symmetries(skewed).transforms(diameter=1.0)
    np.testing.assert_array_equal(transforms[1:], [s.transforms[0] for s in skewed])


def test_a_solid_of_revolution_has_its_axis_and_its_best_flip() -> None:
    symmetries = as_symmetries([about(X, 2, [0, 0, 0.1]), about(Z, None, [0.2, 0, 0]), about(Y, 2)])
    assert [s.axis for s in symmetries.continuous] == [(0.0, 0.0, 1.0)]
    assert [s.offset for s in symmetries.continuous] == [(0.2, 0.0, 0.0)]
    (flip,) = symmetries.discrete
    np.testing.assert_allclose(flip, about(X, 2, [0, 0, 0.1]).transforms[0])


def test_a_cone_is_not_turned_over() -> None:
    assert as_symmetries([about(Z, None)]).discrete == ()


def test_a_sphere_has_its_axes_side_by_side() -> None:
    symmetries = as_symmetries([about(axis, None) for axis in (X, Y, Z)])
    assert len(symmetries.continuous) == 3
    assert symmetries.discrete == ()


def test_refuses_axes_that_contradict_each_other() -> None:
    with pytest.raises(ValueError, match="axes contradict each other"):
        as_symmetries([about(Z, 5), about([0.0, np.sin(0.7), np.cos(0.7)], 7)])
