"""Objects whose pose is known attract nothing, hide what is behind them, and do not let themselves be seen
through."""

import numpy as np
import pytest

from registration_core import SnapConfig, explained_pixels, snap
from registration_core.geometry import pose
from registration_core.geometry.kernels import to_rows
from registration_core.judge.pixel_evidence import INSIDE_BINS, MATCHED, OFF_BINS, RING, UNMEASURED, evidence
from registration_core.rendering.rasterizer import render_depth
from registration_core.search.observation import observe
from registration_core.search.viewpoint_model import viewpoint_model
from tests.registration_core.simple_scene import CAMERA, block, model_of, nearest, noisy, tool

T_CAMERA_TABLE = pose.exp([0.0, 0.12, 0.85, np.radians(-125.0), 0.0, 0.0])


def on_table(x: float, y: float, turn: float) -> np.ndarray:
    return T_CAMERA_TABLE @ pose.exp([x, y, 0.035, 0.0, 0.0, turn])


@pytest.fixture(scope="module")
def pair():
    """Two of the same tool on a table: the model, the depth image, and where each is."""
    model = tool()
    done, sought = on_table(-0.06, 0.0, 0.6), on_table(0.12, 0.02, 0.9)
    table = model_of(block((1.2, 1.2, 0.02), (0.0, 0.0, -0.01)))
    surfaces = [render_depth(table, CAMERA, T_CAMERA_TABLE)]
    depth = noisy(nearest(*surfaces, *(render_depth(model, CAMERA, T) for T in (done, sought))))
    return model, depth, done, sought


def offset(T: np.ndarray, truth: np.ndarray) -> float:
    return float(np.linalg.norm(T[:3, 3] - truth[:3, 3]))


@pytest.mark.parametrize("method", ["viewpoint", pytest.param("particle_filter", marks=pytest.mark.slow)])
def test_snap_passes_by_a_twin_that_is_known(pair, method) -> None:
    model, depth, done, sought = pair
    start = on_table(0.0, 0.01, 0.7)  # nearer to the twin
    config = SnapConfig(method=method)
    mask = explained_pixels(depth, CAMERA, [(model, done)])
    alone = snap(model, depth, CAMERA, start, config, np.random.default_rng(1))
    assert offset(alone.T_camera_object, done) < 0.02
    knowing = snap(model, depth, CAMERA, start, config, np.random.default_rng(1), explained=mask)
    assert offset(knowing.T_camera_object, sought) < 0.02


def test_nothing_known_gives_the_same_estimate(pair) -> None:
    model, depth, _, sought = pair
    start = sought @ pose.exp([0.02, 0.01, 0.0, 0.1, 0.0, 0.2])
    none = np.zeros(depth.shape, dtype=np.bool_)
    estimates = [
        snap(model, depth, CAMERA, start, rng=np.random.default_rng(1), explained=mask)
        for mask in (None, none)
    ]
    assert (estimates[0].T_camera_object == estimates[1].T_camera_object).all()
    assert estimates[0].confidence == estimates[1].confidence


def test_where_all_is_known_the_start_is_kept(pair) -> None:
    model, depth, done, _ = pair
    start = done @ pose.exp([0.02, 0.0, 0.0, 0.0, 0.0, 0.1])
    every = np.ones(depth.shape, dtype=np.bool_)
    estimate = snap(model, depth, CAMERA, start, rng=np.random.default_rng(1), explained=every)
    assert np.allclose(estimate.T_camera_object, start)
    assert estimate.confidence < 0.2


def test_known_object_is_found_in_the_image_and_nothing_else_is(pair) -> None:
    model, depth, done, sought = pair
    mask = explained_pixels(depth, CAMERA, [(model, done)])
    of_done, of_sought = (render_depth(model, CAMERA, T) > 0 for T in (done, sought))
    assert mask[of_done].mean() > 0.95
    assert mask[of_sought & ~of_done].mean() < 0.02
    assert not explained_pixels(depth, CAMERA, []).any()


def test_what_a_nearer_thing_hides_is_not_explained(pair) -> None:
    model, depth, done, _ = pair
    outline = render_depth(model, CAMERA, done) > 0
    hidden = np.where(outline, np.float32(0.3), depth)
    assert not explained_pixels(hidden, CAMERA, [(model, done)])[outline].any()


def counts_of(pair, T: np.ndarray) -> np.ndarray:
    """The evidence inside the outline of a pose, (INSIDE_BINS,), where the twin is known."""
    model, depth, done, _ = pair
    viewpoints = viewpoint_model(model)
    centred = T @ pose.from_rotation_translation(np.eye(3), viewpoints.centre)
    mask = explained_pixels(depth, CAMERA, [(model, done)])
    observed = observe(
        depth, CAMERA, centred[:3, 3], viewpoints, SnapConfig().observation, np.random.default_rng(0), mask
    )
    counts = evidence(to_rows(centred), viewpoints, observed.grid, centred[2, 3])[0]
    return counts[:INSIDE_BINS] + counts[INSIDE_BINS:RING]


def test_behind_a_known_object_lies_the_unknown(pair) -> None:
    _, _, done, _ = pair
    behind = counts_of(pair, pose.exp([*(0.15 * done[:3, 3]), 0, 0, 0]) @ done)
    inside = behind.sum()
    assert behind[0] > 0.9 * inside
    assert behind[UNMEASURED] < 0.1 * inside


def test_known_object_seen_through_a_claim_counts_against_it(pair) -> None:
    _, _, done, _ = pair
    before = counts_of(pair, pose.exp([*(-0.1 * done[:3, 3]), 0, 0, 0]) @ done)
    assert before[OFF_BINS - 1] > 0.9 * before[:OFF_BINS].sum()


def test_place_of_a_known_object_is_no_match(pair) -> None:
    _, _, done, sought = pair
    assert counts_of(pair, done)[MATCHED] < 0.05
    assert counts_of(pair, sought)[MATCHED] > 0.5


@pytest.mark.parametrize("mask", [np.zeros((4, 4), dtype=np.bool_), np.zeros((240, 320))])
def test_wrong_mask_is_refused(pair, mask) -> None:
    model, depth, _, sought = pair
    with pytest.raises(ValueError, match="explained must be booleans"):
        snap(model, depth, CAMERA, sought, explained=mask)
