"""Viewpoints: what is in the middle of the view, how large, and what is up."""

import numpy as np
import pytest

from app.labeling.moves import viewpoint
from app.labeling.moves.viewpoint import Viewpoint
from registration_core.geometry import pose
from tests.app.export.site import NEAR_VIEW

CENTRE = np.array([0.02, 0.05, 0.04])
RADIUS = 0.06
UP = np.array([0.0, 0.0, 1.0])
NOW = Viewpoint(NEAR_VIEW, 0.5, -NEAR_VIEW[:3, 1], field_of_view=0.8, aspect=1.4)


def seen(view: Viewpoint, point: np.ndarray) -> np.ndarray:
    return pose.apply(pose.inverse(view.T_world_camera), point)


def is_rigid(T: np.ndarray) -> bool:
    return np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3)) and np.linalg.det(T[:3, :3]) > 0


@pytest.mark.parametrize(
    ("side", "outward"), [("top", (0, 0, 1)), ("front", (0, -1, 0)), ("side", (1, 0, 0))]
)
def test_each_side_is_looked_at_from_there(side, outward):
    sensor = NEAR_VIEW.copy()
    sensor[:3, 3] = np.add(CENTRE, [0.0, -0.4, 0.3])
    view = viewpoint.from_side(NOW, side, CENTRE, RADIUS, sensor, UP)
    assert is_rigid(view.T_world_camera)
    assert view.target == pytest.approx(CENTRE)
    direction = (view.position - CENTRE) / np.linalg.norm(view.position - CENTRE)
    assert direction @ np.array(outward) > np.cos(0.02)
    height = RADIUS / view.distance / np.tan(view.field_of_view / 2)
    assert 0.2 < height < 0.5
    assert seen(view, CENTRE + 0.01 * UP)[1] < 0  # up is up
    assert seen(view, np.add(CENTRE, [0, 0.01, 0]))[1] <= 1e-9 or side != "top"  # away from the sensor is up


def test_a_sensor_that_looks_straight_down_has_a_front_too():
    sensor = pose.from_rotation_translation(np.diag([1.0, -1.0, -1.0]), np.add(CENTRE, [0, 0, 0.6]))
    view = viewpoint.from_side(NOW, "front", CENTRE, RADIUS, sensor, UP)
    assert is_rigid(view.T_world_camera)
    assert view.position - CENTRE == pytest.approx([0, -view.distance, 0])


def test_the_sensors_view_is_the_sensors():
    view = viewpoint.from_sensor(NOW, NEAR_VIEW, CENTRE)
    assert view.T_world_camera == pytest.approx(NEAR_VIEW)
    assert view.distance == pytest.approx(seen(NOW, CENTRE)[2])
    behind = viewpoint.from_sensor(NOW, NEAR_VIEW, NEAR_VIEW[:3, 3] - NEAR_VIEW[:3, 2])
    assert behind.distance > 0


def test_zooming_keeps_the_direction_and_fills_the_view():
    view = viewpoint.closer(NOW, CENTRE, RADIUS)
    assert view.T_world_camera[:3, :3] == pytest.approx(NOW.T_world_camera[:3, :3])
    assert view.target == pytest.approx(CENTRE)
    assert 0.4 < RADIUS / view.distance / np.tan(view.field_of_view / 2) < 0.8


def test_going_around_keeps_the_object_in_its_place_and_twelve_steps_come_back():
    view = NOW
    for _ in range(12):
        before, view = view, viewpoint.turned(view, CENTRE, np.pi / 6)
        assert seen(view, CENTRE) == pytest.approx(seen(before, CENTRE))
        assert pose.distance(before.T_world_camera, view.T_world_camera).rotation == pytest.approx(np.pi / 6)
    assert view.T_world_camera == pytest.approx(NOW.T_world_camera)


def test_a_ray_goes_through_what_is_seen_there():
    view = viewpoint.closer(NOW, CENTRE, RADIUS)
    assert np.cross(view.ray(0.5, 0.5), view.T_world_camera[:3, 2]) == pytest.approx(0.0)
    corner = seen(view, view.position + view.ray(1.0, 0.0))
    assert np.arctan2(-corner[1], corner[2]) == pytest.approx(view.field_of_view / 2)
    assert corner[0] / -corner[1] == pytest.approx(view.aspect)
