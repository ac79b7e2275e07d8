"""Evidence: every pixel of a candidate is counted once, in the class it belongs to."""

import numpy as np
import pytest

from registration_core import Intrinsics, SnapConfig, pose
from registration_core.evidence import (
    COUNT,
    OFF_PLANE,
    ON_PLANE,
    RING,
    UNMEASURED,
    evidence,
)  # fmt: skip
from registration_core.kernels import centred, f4, to_rows
from registration_core.observation import Grid, observe
from registration_core.rasterizer import render_depth
from registration_core.viewpoint_model import viewpoint_model
from tests.registration_core.simple_scene import block, model_of, standing_tool

CLAIMED = slice(OFF_PLANE, UNMEASURED + 1)
MATCHED = slice(OFF_PLANE + 3, OFF_PLANE + 6)


@pytest.fixture(scope="module")
def scene():
    """(viewpoint model, grid, T_camera_centre) of the standing tool."""
    scene = standing_tool()
    model = viewpoint_model(scene.model)
    truth = centred(scene.truth, model.centre)
    config = SnapConfig().observation
    grid = observe(scene.depth, scene.camera, truth[:3, 3], model, config, np.random.default_rng(0)).grid
    return model, grid, truth


def counted(scene, depth=None, weight=None, **moves):
    """Evidence (COUNT,) of the truth moved by metres along its camera's axes."""
    model, grid, truth = scene
    T = truth.copy()
    T[:3, 3] += [moves.get(axis, 0.0) for axis in "xyz"]
    changed = grid._replace(
        depth=grid.depth if depth is None else depth, weight=grid.weight if weight is None else weight
    )
    return evidence(to_rows(T), model, changed, truth[2, 3])[0]


def test_truth_matches(scene) -> None:
    counts = counted(scene)
    assert counts.shape == (COUNT,)
    assert counts[MATCHED].sum() > 0.75 * counts[CLAIMED].sum()


@pytest.mark.parametrize(("z", "kind"), [(-0.1, 8), (-0.02, 7), (-0.009, 6), (0.009, 2), (0.02, 1), (0.1, 0)])
def test_depth_difference_decides_the_class(scene, z, kind) -> None:
    counts = counted(scene, weight=np.ones_like(scene[1].weight), z=z)
    off = counts[OFF_PLANE:ON_PLANE]
    assert off[kind] > 0.6 * counts[CLAIMED].sum()
    assert counts[ON_PLANE:UNMEASURED].sum() == 0.0


def test_plane_is_counted_apart(scene) -> None:
    counts = counted(scene, weight=np.zeros_like(scene[1].weight))
    assert counts[OFF_PLANE:ON_PLANE].sum() == 0.0
    assert counts[ON_PLANE + 3] > 0.75 * counts[CLAIMED].sum()


def test_without_depth_all_is_unmeasured(scene) -> None:
    counts = counted(scene, depth=np.zeros_like(scene[1].depth))
    assert counts[UNMEASURED] == pytest.approx(counts.sum())
    assert counts[UNMEASURED] > 0.3


@pytest.mark.parametrize(
    ("beyond", "on_plane", "kind"),
    [(0.0, False, 0), (0.60, True, 1), (0.65, True, 2), (0.5, False, 3), (0.59, False, 4), (0.6, False, 5),
     (0.62, False, 6), (0.7, False, 7)],
)  # fmt: skip
def test_what_lies_beyond_the_outline_decides_the_class_of_the_ring(beyond, on_plane, kind) -> None:
    camera = Intrinsics(200, 200, 200.0, 200.0, 99.5, 99.5)
    plate = model_of(block((0.1, 0.1, 0.02)))
    model = viewpoint_model(plate)
    T = pose.exp([0.0, 0.0, 0.6, 0.0, 0.0, 0.0])
    alone = render_depth(plate, camera, T)
    depth = np.where(alone > 0, alone, np.float32(beyond))
    weight = np.where((alone == 0) & on_plane, np.float32(0.1), np.float32(1.0))
    known = np.zeros((200, 200), np.bool_)
    grid = Grid(depth, np.zeros((3, 200, 200), np.float32), weight, *map(f4, (200, 200, 99.5, 99.5)), known)
    ring = evidence(to_rows(T), model, grid, 0.6)[0][RING : RING + 8]
    assert ring[kind] > 0.1
    assert ring.sum() == ring[kind]


def test_candidate_outside_of_the_image_counts_nothing(scene) -> None:
    assert counted(scene, x=5.0).sum() == 0.0


def test_shares_do_not_depend_on_the_resolution() -> None:
    scene = standing_tool()
    model = viewpoint_model(scene.model)
    truth = centred(scene.truth, model.centre)
    config = SnapConfig().observation
    twice = type(scene.camera)(
        640, 480, 2 * scene.camera.fx, 2 * scene.camera.fy, 2 * scene.camera.cx + 0.5,
        2 * scene.camera.cy + 0.5,
    )  # fmt: skip
    counts = []
    for depth, camera in ((scene.depth, scene.camera), (scene.depth.repeat(2, 0).repeat(2, 1), twice)):
        observed = observe(depth, camera, truth[:3, 3], model, config, np.random.default_rng(0))
        counts.append(evidence(to_rows(truth), model, observed.grid, truth[2, 3])[0][CLAIMED].sum())
    assert counts[0] == pytest.approx(counts[1], rel=0.05)
