"""Where an object stands when its registration begins."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.datasets.start_pose import DISTANCE_WITHOUT_DEPTH, start_pose
from registration_core.geometry import pose
from registration_core.geometry.camera import project
from registration_core.rendering.rasterizer import render_depth
from tests.app.export.site import CAMERA, NEAR_VIEW, TOOL, mesh_of, model_of

MODEL = model_of(mesh_of(TOOL))
WALL = np.full((CAMERA.height, CAMERA.width), 0.8, dtype=np.float32)
cameras = st.lists(st.floats(-2.0, 2.0), min_size=6, max_size=6).map(pose.exp)


def centre_in_camera(T_world_object, T_world_camera) -> np.ndarray:
    return pose.apply(pose.inverse(T_world_camera) @ T_world_object, MODEL.centre)


@given(cameras, st.floats(0.3, 3.0))
def test_it_stands_in_the_middle_just_before_what_is_seen(T_world_camera, distance):
    T = start_pose(MODEL, np.full_like(WALL, distance), CAMERA, T_world_camera)
    assert pose.checked(T, "start") == pytest.approx(T, abs=1e-9)
    centre = centre_in_camera(T, T_world_camera)
    assert project(centre, CAMERA) == pytest.approx([CAMERA.width / 2, CAMERA.height / 2])
    assert centre[2] == pytest.approx(distance - MODEL.radius, abs=1e-6)


def test_all_of_it_is_in_view():
    T = start_pose(MODEL, WALL, CAMERA, NEAR_VIEW)
    rendered = render_depth(MODEL, CAMERA, pose.inverse(NEAR_VIEW) @ T)
    rows, columns = np.nonzero(rendered)
    assert len(rows) > 300
    assert rows.min() > 0 and rows.max() < CAMERA.height - 1
    assert columns.min() > 0 and columns.max() < CAMERA.width - 1


def test_its_axes_do_not_hide_each_other():
    T = start_pose(MODEL, WALL, CAMERA, np.eye(4))
    to_viewer = T[:3, :3].T @ [0.0, 0.0, -1.0]
    assert (np.abs(to_viewer) > 0.3).all()
    assert to_viewer[2] > 0  # seen from above


def test_it_does_not_stand_in_the_camera():
    T = start_pose(MODEL, np.full_like(WALL, 0.01), CAMERA, np.eye(4))
    assert centre_in_camera(T, np.eye(4))[2] == pytest.approx(2 * MODEL.radius)


def test_the_middle_counts_and_else_the_whole_image():
    depth = np.zeros_like(WALL)
    depth[:10, :10] = 2.0
    T = start_pose(MODEL, depth, CAMERA, np.eye(4))
    assert centre_in_camera(T, np.eye(4))[2] == pytest.approx(2.0 - MODEL.radius, abs=1e-6)
    depth[CAMERA.height // 2, CAMERA.width // 2] = 1.0
    T = start_pose(MODEL, depth, CAMERA, np.eye(4))
    assert centre_in_camera(T, np.eye(4))[2] == pytest.approx(1.0 - MODEL.radius, abs=1e-6)


def test_without_any_depth_it_stands_at_arms_length():
    T = start_pose(MODEL, np.zeros_like(WALL), CAMERA, np.eye(4))
    assert centre_in_camera(T, np.eye(4))[2] == pytest.approx(DISTANCE_WITHOUT_DEPTH - MODEL.radius)
