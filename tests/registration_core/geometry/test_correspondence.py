"""Pose from clicked pairs: known poses, the honesty of the spread, and refusals that help to click again."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from registration_core import snap
from registration_core.geometry import pose
from registration_core.geometry.correspondence import Correspondence, pose_from_correspondences
from tests.registration_core.simple_scene import standing_tool

TRIANGLE = np.array([[0.0, 0.0, 0.02], [0.09, 0.01, 0.0], [0.02, 0.07, 0.01]])
TETRAHEDRON = np.array([[0.0, 0.0, 0.0], [0.09, 0.0, 0.0], [0.0, 0.08, 0.0], [0.01, 0.01, 0.07]])
TRUTH = pose.exp([0.1, -0.05, 0.8, 2.0, -0.7, 0.4])


def clicked(points, rng: np.random.Generator, noise: float = 0.005):
    """Where an operator clicks in the scene for `points` of the object."""
    return pose.apply(TRUTH, points) + rng.normal(scale=noise, size=np.shape(points))


@given(st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6), st.integers(3, 8), st.integers(0, 99))
def test_recovers_any_pose_from_exact_clicks(twist, count, seed) -> None:
    points = np.random.default_rng(seed).uniform(-0.1, 0.1, size=(count, 3))
    scatter = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    assume(scatter[1] > 0.012)
    assume(min(np.linalg.norm(a - b) for i, a in enumerate(points) for b in points[:i]) > 0.005)
    T = pose.exp(twist)
    found = pose_from_correspondences(points, pose.apply(T, points))
    np.testing.assert_allclose(found.T_camera_object, T, atol=1e-9)
    np.testing.assert_allclose(found.residuals, 0.0, atol=1e-9)
    assert pose.checked(found.T_camera_object, "T") is not None


def test_the_fit_is_the_least_squares_one() -> None:
    rng = np.random.default_rng(3)
    seen = clicked(TETRAHEDRON, rng)
    found = pose_from_correspondences(TETRAHEDRON, seen)
    assert found.rms == pytest.approx(np.sqrt(np.mean(found.residuals**2)))
    for step in rng.normal(scale=1e-3, size=(50, 6)):
        moved = pose.exp(step) @ found.T_camera_object
        misses = np.linalg.norm(pose.apply(moved, TETRAHEDRON) - seen, axis=1)
        assert np.sum(misses**2) > np.sum(found.residuals**2)


@pytest.mark.parametrize("centre", [(0.0, 0.0, 0.0), (0.1, -0.1, 0.2)])
@pytest.mark.parametrize("points", [TRIANGLE, TETRAHEDRON])
def test_the_spread_is_the_error_to_be_expected(points, centre) -> None:
    rng = np.random.default_rng(4)
    noise = 0.003
    misses, expected = [], []
    for _ in range(600):
        found = pose_from_correspondences(points, clicked(points, rng, noise), noise, centre)
        T = found.T_camera_object
        shift = float(np.linalg.norm(pose.apply(T, centre) - pose.apply(TRUTH, centre)))
        misses.append([shift, pose.rotation_angle(T[:3, :3].T @ TRUTH[:3, :3])])
        expected.append(found.start_spread)
    actual = np.sqrt(np.mean(np.square(misses), axis=0))
    # a pair that happens to miss by more widens the spread, so it errs on the wide side
    assert (np.median(expected, axis=0) > 0.9 * actual).all()
    assert (np.median(expected, axis=0) < 1.35 * actual).all()


def test_spread_of_a_square_by_hand() -> None:
    half = 0.05
    square = np.array([[half, half, 0], [-half, half, 0], [-half, -half, 0], [half, -half, 0]])
    found = pose_from_correspondences(square, pose.apply(TRUTH, square), click_noise=0.004)
    # inertia: 4 h^2 about x and y, 8 h^2 about z; four clicks share the shift
    assert found.start_spread[0] == pytest.approx(0.004 * np.sqrt(3.0 / 4.0))
    assert found.start_spread[1] == pytest.approx(0.004 / half * np.sqrt(1 / 4 + 1 / 4 + 1 / 8))


def test_clicks_that_miss_widen_the_spread() -> None:
    exact = pose_from_correspondences(TETRAHEDRON, pose.apply(TRUTH, TETRAHEDRON))
    off = pose.apply(TRUTH, TETRAHEDRON)
    off[1] += 0.02 * (off[1] - off[0]) / np.linalg.norm(off[1] - off[0])
    poor = pose_from_correspondences(TETRAHEDRON, off)
    assert poor.start_spread[0] > 1.2 * exact.start_spread[0]
    assert poor.start_spread[1] > 1.2 * exact.start_spread[1]


def test_three_noisy_clicks_and_a_snap_find_the_object() -> None:
    scene = standing_tool()
    # a corner of the body, of the block on it and of the foot, all of them seen by the camera
    picks = np.array([[-0.04, -0.025, 0.115], [0.095, 0.035, 0.135], [0.035, -0.03, -0.005]])
    for seed in range(6):
        rng = np.random.default_rng(seed)
        seen = pose.apply(scene.truth, picks) + rng.normal(scale=0.005, size=picks.shape)
        start = pose_from_correspondences(picks, seen, centre=scene.model.centre)
        estimate = snap(
            scene.model, scene.depth, scene.camera, start.T_camera_object,
            rng=np.random.default_rng(seed), start_spread=start.start_spread,
        )  # fmt: skip
        apart = pose.distance(estimate.T_camera_object, scene.truth)
        assert apart.translation < 0.005
        assert apart.rotation < np.radians(3.0)


def wrong(points, index: int, value) -> np.ndarray:
    changed = np.array(points)
    changed[index] = value
    return changed


@pytest.mark.parametrize(
    ("points_object", "points_camera", "message"),
    [
        (TRIANGLE[:2], TRIANGLE[:2], "points_object must hold three points or more; it holds 2"),
        (TRIANGLE, TRIANGLE[:2], "points_camera must hold three points or more; it holds 2"),
        (TRIANGLE, TETRAHEDRON, "points_camera must hold as many points as points_object; it has 4 and"),
        (TRIANGLE[:, :2], TRIANGLE, r"points_object must have the shape \(N, 3\); it has \(3, 2\)"),
        (TRIANGLE, TRIANGLE.ravel(), r"points_camera must have the shape \(N, 3\); it has \(9,\)"),
        ([["a", "b", "c"]] * 3, TRIANGLE, r"points_object must be an array \(N, 3\) of numbers"),
        (TRIANGLE, wrong(TRIANGLE, 1, np.nan), "points_camera must hold finite numbers only"),
        (wrong(TRIANGLE, 1, np.inf), TRIANGLE, "points_object must hold finite numbers only"),
        (
            wrong(TETRAHEDRON, 3, TETRAHEDRON[1] + 0.001),
            TETRAHEDRON,
            "points_object must lie apart from each other; points 2 and 4 are 2 mm apart",
        ),
        (
            TRIANGLE,
            wrong(TRIANGLE, 2, (TRIANGLE[0] + TRIANGLE[1]) / 2 + 0.004),
            "points_camera must not lie on one line",
        ),
    ],
)
def test_refuses_bad_points_by_name(points_object, points_camera, message) -> None:
    with pytest.raises(ValueError, match=message):
        pose_from_correspondences(points_object, points_camera)


@pytest.mark.parametrize("noise", [0.0, -0.001, np.nan])
def test_refuses_a_click_noise_that_is_none(noise) -> None:
    with pytest.raises(ValueError, match="click_noise must be a length in metres above 0"):
        pose_from_correspondences(TRIANGLE, TRIANGLE, noise)


def test_refuses_a_centre_that_is_no_point() -> None:
    with pytest.raises(ValueError, match="centre must be one point"):
        pose_from_correspondences(TRIANGLE, TRIANGLE, centre=(0.0, np.nan, 0.0))


@pytest.mark.parametrize("points", [TRIANGLE, TETRAHEDRON])
def test_names_the_pair_that_does_not_fit(points) -> None:
    for pair in range(len(points)):
        seen = pose.apply(TRUTH, points)
        seen[pair] += 0.05 * (seen[pair] - seen.mean(axis=0)) / np.linalg.norm(seen[pair] - seen.mean(axis=0))
        with pytest.raises(ValueError, match=f"pair {pair + 1} does not fit the others by [345]. mm"):
            pose_from_correspondences(points, seen)


def test_says_by_how_much_a_pair_does_not_fit() -> None:
    line = TRIANGLE[1] - TRIANGLE[0]
    seen = wrong(TRIANGLE, 1, TRIANGLE[1] + 0.038 * line / np.linalg.norm(line))
    with pytest.raises(ValueError, match="pair 2 does not fit the others by 38 mm: click it again"):
        pose_from_correspondences(TRIANGLE, seen)


def test_finer_clicks_are_held_to_a_finer_limit() -> None:
    seen = wrong(TRIANGLE, 1, TRIANGLE[1] + [0.012, 0.0, 0.0])
    assert pose_from_correspondences(TRIANGLE, seen).rms > 0.002
    with pytest.raises(ValueError, match="pair 2 does not fit the others"):
        pose_from_correspondences(TRIANGLE, seen, click_noise=0.001)


def test_a_mirror_image_is_refused() -> None:
    with pytest.raises(ValueError, match="points_camera must not be the mirror image of points_object"):
        pose_from_correspondences(TETRAHEDRON, TETRAHEDRON * [1.0, 1.0, -1.0])


def test_a_click_on_the_background_is_no_mirror_image() -> None:
    """A corner of a square pushed far out of its plane hardly changes the distances to the other three."""
    square = np.array([[0.08, 0.08, 0.0], [-0.08, 0.08, 0.0], [-0.08, -0.08, 0.0], [0.08, -0.08, 0.0]])
    seen = wrong(square, 2, square[2] + [0.0, 0.0, 0.07])
    with pytest.raises(ValueError, match="pair 3 does not fit the others by 20 mm: click it again"):
        pose_from_correspondences(square, seen, click_noise=0.003)


def test_a_flat_mirror_image_is_turned_over_not_reflected() -> None:
    """Points of one plane fit their mirror image by half a turn."""
    flat = TETRAHEDRON * [1.0, 1.0, 0.0] + [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0.05, 0.05, 0.0]]
    found: Correspondence = pose_from_correspondences(flat, flat * [-1.0, 1.0, 1.0])
    assert np.linalg.det(found.T_camera_object[:3, :3]) == pytest.approx(1.0)
    assert found.rms == pytest.approx(0.0, abs=1e-9)


def test_clicks_of_ordinary_noise_are_rarely_refused() -> None:
    rng = np.random.default_rng(1)
    for _ in range(300):
        pose_from_correspondences(0.2 * TETRAHEDRON / 0.09, clicked(0.2 * TETRAHEDRON / 0.09, rng))
