"""Reduction, normals and the plane of a depth image that is known."""

import numpy as np
import pytest

from registration_core import Intrinsics, SnapConfig
from registration_core.geometry import pose
from registration_core.geometry.camera import depth_to_points
from registration_core.rendering.rasterizer import render_depth
from registration_core.search.color_edges import color_changes
from registration_core.search.observation import is_held_out, observe, reduction, window
from registration_core.search.viewpoint_model import viewpoint_model
from tests.registration_core.simple_scene import block, model_of, standing_tool, tool

CONFIG = SnapConfig().observation
CENTRE = np.array([0.0, 0.0, 0.8])


def look(depth, camera, centre=CENTRE):
    model = viewpoint_model(tool())
    return observe(depth, camera, centre, model, CONFIG, np.random.default_rng(0))


@pytest.mark.parametrize("focal", [150.0, 300.0, 1200.0])
def test_tilted_plane_keeps_its_depth_and_normal_at_every_reduction(focal) -> None:
    size = int(focal * 0.8)
    camera = Intrinsics(size, size, focal, focal, size / 2 - 0.5, size / 2 - 0.5)
    plane = model_of(block((3.0, 3.0, 0.01)))
    T = pose.exp([0.0, 0.0, 0.8, 0.5, 0.2, 0.0])
    grid = look(render_depth(plane, camera, T), camera).grid
    rows, columns = grid.depth.shape
    reduced = Intrinsics(columns, rows, *map(float, (grid.fx, grid.fy, grid.cx, grid.cy)))
    points = depth_to_points(grid.depth, reduced)[grid.depth > 0]
    off_plane = (points - T[:3, 3]) @ T[:3, 2]
    assert np.abs(off_plane - np.median(off_plane)).max() < 0.002
    inner = grid.normals[:, 4:-4, 4:-4]
    np.testing.assert_allclose(np.abs(np.einsum("chw,c->hw", inner, T[:3, 2])), 1.0, atol=2e-3)
    assert (inner[2] < 0).all()  # towards the camera


def test_table_weighs_little_and_the_object_much() -> None:
    scene = standing_tool()
    centre = pose.apply(scene.truth, scene.model.centre)
    grid = look(scene.depth, scene.camera, centre).grid
    assert 0.2 < (grid.weight < 1).mean() < 0.95
    row = round(float(centre[1] / centre[2] * grid.fy + grid.cy))
    column = round(float(centre[0] / centre[2] * grid.fx + grid.cx))
    assert grid.weight[row, column] == 1.0


def test_flat_side_of_a_masked_object_is_no_table() -> None:
    scene = standing_tool()
    alone = render_depth(scene.model, scene.camera, scene.truth)
    centre = pose.apply(scene.truth, scene.model.centre)
    assert (look(alone, scene.camera, centre).grid.weight == 1.0).all()


@pytest.mark.parametrize("block", [1, 2, 4])
def test_colours_are_read_unreduced_where_the_depth_is(block) -> None:
    size, focal = 60 * block, 200.0 * block
    camera = Intrinsics(size, size + 8, focal, focal, size / 2, size / 2)
    depth = np.full((camera.height, camera.width), 0.8, np.float32)
    color = np.random.default_rng(0).integers(0, 256, (*depth.shape, 3)).astype(np.uint8)
    model, near = viewpoint_model(tool()), np.array([0.05, -0.03, 0.8])
    observed = observe(depth, camera, near, model, CONFIG, np.random.default_rng(0), None, color)
    rows, columns = (block * (side - 2) for side in observed.grid.depth.shape)
    left, top, _, _ = window(camera, near, model.radius, CONFIG.reach)
    seen = color[top : top + rows, left : left + columns]
    assert observed.block == block
    np.testing.assert_array_equal(observed.grid.changes, color_changes(seen))
    assert look(depth, camera, near).grid.changes.size == 0


def test_border_is_never_measured() -> None:
    depth = look(
        np.full((240, 320), 0.8, np.float32), Intrinsics(320, 240, 262.0, 262.0, 159.5, 119.5)
    ).grid.depth
    assert not depth[[0, -1]].any()
    assert not depth[:, [0, -1]].any()


@pytest.mark.parametrize(("focal", "are_read"), [(150.0, True), (300.0, False), (1200.0, False)])
def test_pixels_that_are_held_out_are_not_read_where_the_image_is_reduced(focal, are_read) -> None:
    size = int(focal * 0.8)
    camera = Intrinsics(size, size, focal, focal, size / 2 - 0.5, size / 2 - 0.5)
    depth = render_depth(model_of(block((3.0, 3.0, 0.01))), camera, pose.exp([0, 0, 0.8, 0.5, 0.2, 0]))
    other = np.where(is_held_out(*np.indices(depth.shape)), np.float32(0.7), depth)
    before, after = look(depth, camera).grid, look(other, camera).grid
    assert np.array_equal(before.depth, after.depth) != are_read


def test_window_is_aligned_and_within_the_image() -> None:
    camera = Intrinsics(323, 241, 262.5, 262.5, 159.5, 119.5)
    left, top, right, bottom = window(camera, np.array([0.05, 0.02, 0.9]), 0.1, 0.1)
    assert left % 8 == top % 8 == 0
    assert 0 <= left < right <= 323
    assert 0 <= top < bottom <= 241


@pytest.mark.parametrize(("distance", "block"), [(0.2, 4), (0.8, 2), (3.0, 1)])
def test_object_stays_resolved(distance, block) -> None:
    camera = Intrinsics(640, 480, 525.0, 525.0, 319.5, 239.5)
    assert reduction(camera, 0.12, distance, 30, 4) == block
