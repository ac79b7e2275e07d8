"""Silhouettes and visible parts against counts done by hand."""

import numpy as np
import pytest

from app.export.content.visibility import appearance, is_before_camera, silhouette_window
from registration_core import Intrinsics, ObjectModel
from registration_core.geometry import pose
from registration_core.rendering.rasterizer import render_depth

CAMERA = Intrinsics(100, 80, 100.0, 100.0, 49.5, 39.5)
PLATE = ObjectModel(
    np.array([[-0.1, -0.05, 0.0], [0.1, -0.05, 0.0], [0.1, 0.05, 0.0], [-0.1, 0.05, 0.0]]),
    np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32),
)
"""At 1 m it covers 20 by 10 pixels: columns 40 to 59 and rows 35 to 44 where it stands in the middle."""


def at(x: float = 0.0, y: float = 0.0, z: float = 1.0) -> np.ndarray:
    return pose.exp([x, y, z, 0.0, 0.0, 0.0])


def depth_image(value: float) -> np.ndarray:
    return np.full((80, 100), value, dtype=np.float32)


def test_a_free_plate_is_seen_whole() -> None:
    shown = appearance(PLATE, depth_image(1.0), CAMERA, at())
    assert shown.info == {
        "bbox_obj": [40, 35, 19, 9],
        "bbox_visib": [40, 35, 19, 9],
        "px_count_all": 200,
        "px_count_valid": 200,
        "px_count_visib": 200,
        "visib_fract": 1.0,
    }
    assert shown.mask[35:45, 40:60].all() and shown.mask.sum() == 200


def test_a_surface_more_than_15_mm_behind_the_observed_one_is_hidden() -> None:
    depth = depth_image(1.0)
    depth[:, :50] = 1.0 - 0.0155
    depth[:, 50:] = 1.0 - 0.0140
    shown = appearance(PLATE, depth, CAMERA, at())
    assert not shown.mask_visib[:, :50].any()
    assert shown.info["px_count_visib"] == 100
    assert shown.info["bbox_visib"] == [50, 35, 9, 9]
    assert shown.info["visib_fract"] == 0.5


def test_missing_depth_counts_as_visible_but_not_as_valid() -> None:
    depth = depth_image(0.5)
    depth[35:37] = 0.0
    shown = appearance(PLATE, depth, CAMERA, at())
    assert shown.info["px_count_visib"] == 40
    assert shown.info["px_count_valid"] == 160


def test_the_part_outside_the_image_is_counted() -> None:
    shown = appearance(PLATE, depth_image(1.0), CAMERA, at(x=-0.5))
    assert shown.mask.sum() == 100
    assert shown.info["bbox_obj"] == [-10, 35, 19, 9]
    assert shown.info["bbox_visib"] == [0, 35, 9, 9]
    assert shown.info["px_count_all"] == 200
    assert shown.info["visib_fract"] == 0.5


@pytest.mark.parametrize(("x", "count"), [(-0.8, 200), (-3.0, 0)])
def test_a_plate_wholly_outside_the_image_has_no_boxes(x: float, count: int) -> None:
    shown = appearance(PLATE, depth_image(1.0), CAMERA, at(x=x))
    assert not shown.mask.any() and not shown.mask_visib.any()
    assert shown.info == {
        "bbox_obj": [-1, -1, -1, -1],
        "bbox_visib": [-1, -1, -1, -1],
        "px_count_all": count,
        "px_count_valid": 0,
        "px_count_visib": 0,
        "visib_fract": 0.0,
    }


def test_what_does_not_reach_past_the_near_plane_is_not_before_the_camera() -> None:
    assert is_before_camera(PLATE, at())
    assert not is_before_camera(PLATE, at(z=-1.0))
    assert is_before_camera(PLATE, at(z=0.0) @ pose.exp([0.0, 0.0, 0.0, 0.0, np.pi / 2, 0.0]))


def test_the_window_holds_all_that_the_whole_canvas_shows() -> None:
    canvas = CAMERA.cropped(-100, -80, 300, 240)
    rng = np.random.default_rng(0)
    for _ in range(50):
        T = pose.exp(np.concatenate([rng.uniform([-1, -1, 0.05], [1, 1, 1]), rng.normal(size=3)]))
        whole = render_depth(PLATE, canvas, T)
        left, top, width, height = silhouette_window(PLATE, CAMERA, T)
        window = render_depth(PLATE, CAMERA.cropped(left, top, width, height), T)
        inside = whole[top + 80 : top + 80 + height, left + 100 : left + 100 + width]
        np.testing.assert_allclose(window, inside, rtol=1e-5)
        assert np.count_nonzero(whole) == np.count_nonzero(inside)
