import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from registration_core.geometry import pose
from registration_core.geometry.camera import Intrinsics
from registration_core.geometry.object_model import ContinuousSymmetry, ObjectModel, Symmetries, discrete
from registration_core.geometry.pose_error import (
    add,
    adi,
    mspd,
    mssd,
    rotation_error,
    translation_error,
    visible,
    vsd,
)
from registration_core.rendering.rasterizer import render_depth

CORNERS = np.array([[x, y, z] for x in (-0.03, 0.03) for y in (-0.05, 0.05) for z in (-0.08, 0.08)])
HALF_TURN = pose.exp([0, 0, 0, 0, 0, np.pi])
CAMERA = Intrinsics(width=80, height=60, fx=100, fy=100, cx=39.5, cy=29.5)

numbers = st.floats(-1.0, 1.0)
poses = st.lists(numbers, min_size=6, max_size=6).map(lambda t: pose.exp([*t[:2], 3.0 + t[2], *t[3:]]))


def at(x: float, y: float, z: float) -> np.ndarray:
    return pose.from_rotation_translation(np.eye(3), [x, y, z])


def test_translation_error_is_the_distance_of_the_origins():
    assert translation_error(at(0, 0, 1), at(0.3, 0.4, 1)) == pytest.approx(0.5)


def test_rotation_error_is_the_angle():
    assert rotation_error(pose.exp([0, 0, 0, 0.2, 0, 0]), pose.exp([1, 1, 1, -0.1, 0, 0])) == pytest.approx(
        0.3
    )


def test_rotation_error_is_the_least_over_symmetries():
    turned = HALF_TURN @ pose.exp([0, 0, 0, 0, 0, 0.1])
    assert rotation_error(turned, np.eye(4), np.stack([np.eye(4), HALF_TURN])) == pytest.approx(0.1)
    assert rotation_error(turned, np.eye(4)) == pytest.approx(np.pi - 0.1)


def test_a_pure_shift_moves_every_point_alike():
    estimate, truth = at(0.01, 0, 1), at(0, 0, 1)
    assert add(estimate, truth, CORNERS) == pytest.approx(0.01)
    assert mssd(estimate, truth, CORNERS) == pytest.approx(0.01)
    assert adi(estimate, truth, CORNERS) == pytest.approx(0.01)


def test_add_of_a_quarter_turn_by_hand():
    points = np.array(
        [[0.1, 0, 0], [0, 0, 0.5]]
    )  # the first moves by sqrt(2) * 0.1, the second lies on the axis
    quarter = pose.exp([0, 0, 0, 0, 0, np.pi / 2])
    assert add(quarter, np.eye(4), points) == pytest.approx(np.sqrt(2) * 0.05)
    assert mssd(quarter, np.eye(4), points) == pytest.approx(np.sqrt(2) * 0.1)


def test_adi_ignores_which_point_is_which():
    assert adi(HALF_TURN, np.eye(4), CORNERS) == pytest.approx(0.0, abs=1e-12)
    assert add(HALF_TURN, np.eye(4), CORNERS) == pytest.approx(2 * np.hypot(0.03, 0.05))


def test_adi_asks_from_the_true_points_to_the_estimated_ones():
    points = np.array([[0, 0, 0], [1.0, 0, 0]])
    # Truth: 0 and 1; estimate: 1 and 2. From the truth the nearest are 1 and 0 away.
    assert adi(at(1, 0, 0), at(0, 0, 0), points) == pytest.approx(0.5)


def test_mspd_of_a_shift_by_hand():
    points = np.zeros((1, 3))
    # 1 cm at 0.5 m with a focal length of 100 pixels is 2 pixels.
    assert mspd(at(0.01, 0, 0.5), at(0, 0, 0.5), points, CAMERA) == pytest.approx(2.0)


def test_symmetric_errors_take_the_nearest_twin():
    truth = at(0.1, 0.0, 1.0)
    symmetries = Symmetries(continuous=(ContinuousSymmetry((0, 0, 1), offset=(0.02, 0, 0)),)).transforms(0.2)
    estimate = truth @ symmetries[100]
    assert mssd(estimate, truth, CORNERS, symmetries) == pytest.approx(0.0, abs=1e-12)
    assert mspd(estimate, truth, CORNERS, CAMERA, symmetries) == pytest.approx(0.0, abs=1e-9)
    assert mssd(estimate, truth, CORNERS) > 0.05


@given(poses, poses)
def test_laws_of_the_errors(estimate, truth):
    symmetries = np.stack([np.eye(4), HALF_TURN])
    assert adi(estimate, truth, CORNERS) <= add(estimate, truth, CORNERS) + 1e-12
    assert add(estimate, truth, CORNERS) <= mssd(estimate, truth, CORNERS) + 1e-12
    assert mssd(estimate, truth, CORNERS, symmetries) <= mssd(estimate, truth, CORNERS)
    assert mssd(truth, truth, CORNERS, symmetries) == 0.0
    assert mssd(estimate, truth, CORNERS, symmetries) == pytest.approx(
        mssd(estimate @ HALF_TURN, truth, CORNERS, symmetries)
    )


@given(poses, poses, poses)
def test_errors_of_points_do_not_depend_on_the_world(world, estimate, truth):
    for error in (add, adi, mssd):
        assert error(world @ estimate, world @ truth, CORNERS) == pytest.approx(
            error(estimate, truth, CORNERS), abs=1e-9
        )


def test_mssd_of_the_hull_is_that_of_all_points(shared_data):
    model = ObjectModel.load(shared_data / "ycbv/models/obj_000014.ply", "mm", discrete([HALF_TURN]))
    estimate = pose.perturbed(at(0, 0, 0.6), 0.02, 0.3, np.random.default_rng(0))
    symmetries = model.symmetry_transforms
    everything = mssd(estimate, at(0, 0, 0.6), model.vertices, symmetries)
    corners = model.vertices[ConvexHull(model.vertices).vertices]
    assert mssd(estimate, at(0, 0, 0.6), corners, symmetries) == pytest.approx(everything, rel=1e-12)


def plane(z: float, columns: slice) -> np.ndarray:
    """A frontal plane at depth z that covers some columns."""
    depth = np.zeros((CAMERA.height, CAMERA.width), dtype=np.float32)
    depth[:, columns] = z
    return depth


def test_vsd_counts_pixels_of_the_union_that_do_not_match():
    # Truth on columns 0-39, estimate on 20-59, same depth: 20 of 60 columns match.
    truth, estimate = plane(1.0, slice(0, 40)), plane(1.0, slice(20, 60))
    observed = plane(1.0, slice(0, 80))
    assert vsd(estimate, truth, observed, CAMERA, 0.2) == pytest.approx(2 / 3)


def test_vsd_compares_distances_along_the_ray_with_tau():
    # On the axis, 3 cm are 0.15 of a 20 cm diameter; step cost: a distance of tau or more is a mismatch.
    camera = Intrinsics(width=1, height=1, fx=100, fy=100, cx=0, cy=0)
    one = np.ones((1, 1))
    errors = vsd(one + 0.03, one, one, camera, 0.2, delta=0.05, taus=(0.1, 0.14, 0.16, 0.3))
    assert errors.tolist() == [1, 1, 0, 0]


def test_vsd_ignores_what_an_occluder_hides():
    truth, estimate = plane(1.0, slice(0, 40)), plane(1.0, slice(0, 60))
    observed = plane(1.0, slice(0, 40)) + plane(0.5, slice(40, 80))  # hides the estimate's wrong part
    assert vsd(estimate, truth, observed, CAMERA, 0.2) == pytest.approx(0.0)


def test_vsd_is_1_where_nothing_is_visible():
    nothing = plane(0.0, slice(0, 80))
    assert vsd(nothing, nothing, nothing, CAMERA, 0.2).tolist() == [1.0] * 10


def test_missing_depth_counts_as_visible():
    rendered = np.array([[1.0, 1.0, 1.0, 0.0]])
    observed = np.array([[0.0, 0.99, 0.5, 1.0]])
    assert visible(rendered, observed, 0.015).tolist() == [[True, True, False, False]]


def test_vsd_of_real_poses(shared_data):
    model = ObjectModel.load(shared_data / "ycbv/models/obj_000014.ply", "mm")
    truth = at(0, 0, 0.6)
    camera = Intrinsics(width=160, height=120, fx=250, fy=250, cx=79.5, cy=59.5)
    observed = render_depth(model, camera, truth)
    errors = [
        vsd(render_depth(model, camera, at(dx, 0, 0.6)), observed, observed, camera, model.diameter).mean()
        for dx in (0.0, 0.005, 0.02, 0.2)
    ]
    assert errors[0] == 0.0
    assert errors[-1] == 1.0
    assert errors == sorted(errors)
