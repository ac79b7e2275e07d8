"""The supporting plane of a reduced depth image that is known."""

import numpy as np
import pytest

from registration_core import Intrinsics, SnapConfig
from registration_core.geometry import pose
from registration_core.geometry.kernels import f4, random_state
from registration_core.rendering.rasterizer import render_depth
from registration_core.search.observation import Grid, observe
from registration_core.search.supporting_plane import find_plane, mark_plane
from registration_core.search.viewpoint_model import viewpoint_model
from tests.registration_core.simple_scene import block, model_of, nearest, tool

CONFIG = SnapConfig().observation
CAMERA = Intrinsics(160, 120, 150.0, 150.0, 79.5, 59.5)
T_CAMERA_PLANE = pose.exp([0.0, 0.0, 0.8, 0.5, 0.2, 0.0])
TOLERANCE = f4(CONFIG.plane_tolerance)


def grid_of(depth) -> Grid:
    model = viewpoint_model(tool())
    return observe(depth, CAMERA, np.array([0.0, 0.0, 0.8]), model, CONFIG, np.random.default_rng(0)).grid


def found(grid: Grid) -> np.ndarray:
    return find_plane(grid, CONFIG.plane_trials, TOLERANCE, random_state(np.random.default_rng(0)))


@pytest.fixture(scope="module")
def cluttered() -> tuple[Grid, np.ndarray]:
    """A board with a thing before it, and where the board is seen."""
    board = render_depth(model_of(block((3.0, 3.0, 0.0002))), CAMERA, T_CAMERA_PLANE)
    thing = render_depth(tool(), CAMERA, pose.exp([0.0, 0.0, 0.55, 0.3, 0.1, 0.0]))
    grid = grid_of(nearest(board, thing))
    return grid, grid_of(board).depth == grid.depth


def test_the_plane_behind_other_things_is_found(cluttered) -> None:
    grid, _ = cluttered
    *normal, offset, share = found(grid)
    along = np.array(normal) @ T_CAMERA_PLANE[:3, 2]
    assert abs(along) == pytest.approx(1.0, abs=1e-4)
    assert offset == pytest.approx(-along * T_CAMERA_PLANE[:3, 3] @ T_CAMERA_PLANE[:3, 2], abs=1e-3)
    assert 0.5 < share < 1.0


def test_its_pixels_are_marked_and_no_others(cluttered) -> None:
    grid, is_board = cluttered
    marked = np.zeros(grid.depth.shape, np.bool_)
    mark_plane(grid, found(grid), TOLERANCE, marked)
    measured = grid.depth > 0
    assert marked[is_board & measured].mean() > 0.95
    assert marked[~is_board & measured].mean() < 0.05


def test_where_hardly_anything_was_measured_there_is_none() -> None:
    depth = np.zeros((CAMERA.height, CAMERA.width), np.float32)
    depth[60, 70:90] = 0.8
    assert found(grid_of(depth))[4] == 0.0
