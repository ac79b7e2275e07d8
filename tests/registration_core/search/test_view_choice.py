"""A snap is given the views that see the object, the best and the most different ones first."""

import numpy as np
import pytest

from registration_core import Intrinsics
from registration_core.geometry import pose
from registration_core.rendering.rasterizer import render_depth
from registration_core.search.view_choice import LOOKED_AT, best_views, shown_share
from tests.registration_core.simple_scene import CAMERA, block, model_of, nearest

OBJECT = model_of(block((0.1, 0.08, 0.06)))
T_WORLD_OBJECT = pose.exp([0.3, -0.2, 0.1, 0.2, 0.1, 0.4])
WALL = model_of(block((0.4, 0.4, 0.01)))
FLOOR = np.full((CAMERA.height, CAMERA.width), 3.0, dtype=np.float32)


def camera_at(angle: float, distance: float = 0.8):
    """Looks at the object from a side."""
    return T_WORLD_OBJECT @ pose.exp([0, 0, 0, 0, angle, 0]) @ pose.exp([0, 0, -distance, 0, 0, 0])


def seen(T_world_camera, *others):
    """Depth of the object and of others (model, T_world_object) before a far wall."""
    T_camera_world = pose.inverse(T_world_camera)
    drawn = [
        render_depth(model, CAMERA, T_camera_world @ T) for model, T in ((OBJECT, T_WORLD_OBJECT), *others)
    ]
    return nearest(FLOOR, *drawn)


def choose(places, depths, first=0, most=3, known=()):
    cameras = [(CAMERA, T) for T in places]
    return best_views(OBJECT, cameras, lambda index: depths[index], T_WORLD_OBJECT, known, first, most)


def test_the_view_at_hand_comes_first_and_then_the_ones_from_other_sides() -> None:
    places = [camera_at(np.radians(degrees)) for degrees in (0, 5, 60, 65, -60)]
    chosen = choose(places, [seen(T) for T in places])
    assert chosen[0] == 0
    assert sorted(chosen[1:]) in ([2, 4], [3, 4])


def test_a_view_that_says_nothing_new_is_left_out() -> None:
    places = [camera_at(0.0), camera_at(np.radians(1.0)), camera_at(np.radians(40.0))]
    assert choose(places, [seen(T) for T in places]) == [0, 2]


def test_views_that_do_not_see_it_are_left_out_the_one_at_hand_as_well() -> None:
    places = [camera_at(np.radians(degrees)) for degrees in (0, 50, 100, -50)]
    turned_away = places[2] @ pose.exp([0, 0, 0, 0, np.pi, 0])
    wall = (WALL, places[0] @ pose.exp([0, 0, 0.5, 0, 0, 0]))
    depths = [seen(places[0], wall), seen(places[1]), seen(turned_away), np.zeros_like(FLOOR)]
    assert choose([*places[:2], turned_away, places[3]], depths) == [1]


def test_no_view_where_none_sees_it() -> None:
    away = camera_at(0.0) @ pose.exp([0, 0, 0, 0, np.pi, 0])
    assert choose([away], [FLOOR]) == []


def test_the_depth_of_a_few_views_is_asked_for_however_many_there_are() -> None:
    places = [camera_at(np.radians(degrees)) for degrees in np.arange(0.0, 360.0, 2.0)]
    asked = []

    def depth(index: int):
        asked.append(index)
        return seen(places[index])

    cameras = [(CAMERA, T) for T in places]
    chosen = best_views(OBJECT, cameras, depth, T_WORLD_OBJECT, (), 7, 4)
    assert chosen[0] == 7
    assert len(chosen) == 4
    assert len(asked) <= LOOKED_AT


def test_shares_of_what_is_seen() -> None:
    T_camera_object = pose.inverse(camera_at(0.0)) @ T_WORLD_OBJECT
    depth = seen(camera_at(0.0))
    assert shown_share(OBJECT, CAMERA, depth, T_camera_object, ()) == 1.0
    off = pose.exp([0.02, 0, 0.02, 0, 0, 0]) @ T_camera_object
    assert shown_share(OBJECT, CAMERA, depth, off, ()) == 1.0
    half = Intrinsics(CAMERA.width, CAMERA.height, CAMERA.fx, CAMERA.fy, 0.0, CAMERA.cy)
    assert shown_share(OBJECT, half, depth, T_camera_object, ()) == pytest.approx(0.5, abs=0.05)
    halved = depth.copy()
    halved[:, : CAMERA.width // 2] = 0.0
    assert shown_share(OBJECT, CAMERA, halved, T_camera_object, ()) == pytest.approx(0.5, abs=0.05)
    close = [(WALL, pose.exp([-0.2, 0, -0.04, 0, 0, 0]) @ T_camera_object)]
    assert shown_share(OBJECT, CAMERA, depth, T_camera_object, close) == pytest.approx(0.5, abs=0.1)
    behind = pose.exp([0, 0, -1.0, 0, 0, 0])
    assert shown_share(OBJECT, CAMERA, depth, behind, ()) == 0.0
