"""Evidence: every pixel of a candidate is counted once, in the class it belongs to."""

import numpy as np
import pytest

from registration_core import Intrinsics, SnapConfig
from registration_core.geometry import pose
from registration_core.geometry.kernels import centred, f4, to_rows
from registration_core.judge.pixel_evidence import (
    BELOW,
    COLOR_CHANGES,
    COLOR_STEADY,
    COUNT,
    INSIDE_BINS,
    MATCHED,
    MATCHED_ON_PLANE,
    OFF_BINS,
    OFF_RING,
    ON_PLANE,
    RING,
    RING_BINS,
    UNMEASURED,
    below,
    class_names,
    evidence,
)
from registration_core.rendering.rasterizer import render_depth
from registration_core.search.color_edges import BORDER
from registration_core.search.observation import Grid, observe
from registration_core.search.viewpoint_model import viewpoint_model
from tests.registration_core.simple_scene import block, model_of, standing_tool

NEAR_RING, FAR_RING = slice(RING, RING + RING_BINS), slice(RING + RING_BINS, BELOW)


@pytest.fixture(scope="module")
def scene():
    """(viewpoint model, grid, T_camera_centre) of the standing tool."""
    scene = standing_tool()
    model = viewpoint_model(scene.model)
    truth = centred(scene.truth, model.centre)
    config = SnapConfig().observation
    grid = observe(scene.depth, scene.camera, truth[:3, 3], model, config, np.random.default_rng(0)).grid
    return model, grid, truth


def counted(scene, depth=None, on_plane=None, **moves):
    """Evidence (COUNT,) of the truth moved by metres along its camera's axes."""
    model, grid, truth = scene
    T = truth.copy()
    T[:3, 3] += [moves.get(axis, 0.0) for axis in "xyz"]
    changed = grid._replace(
        depth=grid.depth if depth is None else depth,
        on_plane=grid.on_plane if on_plane is None else on_plane,
    )
    return evidence(to_rows(T), model, changed, truth[2, 3])[0]


def inside(counts):
    """Bins (INSIDE_BINS,) of the inner part and the rim together."""
    return counts[:INSIDE_BINS] + counts[INSIDE_BINS:RING]


def test_truth_matches(scene) -> None:
    counts = counted(scene)
    assert counts.shape == (COUNT,)
    bins = inside(counts)
    assert bins[MATCHED] + bins[MATCHED_ON_PLANE] > 0.75 * bins.sum()


def test_each_class_has_a_name_of_its_own() -> None:
    assert len(set(class_names())) == COUNT
    assert class_names()[MATCHED] == "inner, off plane, -6 mm to 6 mm"
    assert class_names()[BELOW] == "below the plane"


@pytest.mark.parametrize(("z", "kind"), [(-0.1, 6), (-0.02, 5), (-0.009, 4), (0.009, 2), (0.02, 1), (0.1, 0)])
def test_depth_difference_decides_the_class(scene, z, kind) -> None:
    bins = inside(counted(scene, on_plane=np.zeros_like(scene[1].on_plane), z=z))
    assert bins[kind] > 0.6 * bins.sum()
    assert bins[ON_PLANE:UNMEASURED].sum() == 0.0


def test_plane_is_counted_apart(scene) -> None:
    bins = inside(counted(scene, on_plane=np.ones_like(scene[1].on_plane)))
    assert bins[:OFF_BINS].sum() == 0.0
    assert bins[MATCHED_ON_PLANE] > 0.75 * bins.sum()


def test_without_depth_all_is_unmeasured(scene) -> None:
    counts = counted(scene, depth=np.zeros_like(scene[1].depth))
    assert inside(counts)[UNMEASURED] == pytest.approx(counts[:BELOW].sum())
    assert inside(counts)[UNMEASURED] > 0.3


def test_rim_is_as_wide_as_two_pixels_and_the_rest_is_inner() -> None:
    T = pose.exp([0.0, 0.0, 0.6, 0.0, 0.0, 0.0])
    grid, model = plate_in_front_of(0.0, False)
    counts = evidence(to_rows(T), model, grid, 0.6)[0]
    edge = 200.0 * 0.1 / 0.59  # of the plate's front, in pixels
    share = counts[:INSIDE_BINS].sum() / counts[:RING].sum()
    assert share == pytest.approx((edge - 4) ** 2 / edge**2, abs=0.05)


def plate_in_front_of(beyond, on_plane):
    """(grid, viewpoint model) of a plate at 0.6 m before something at `beyond` metres, which is the plane or
    not.
    """
    camera = Intrinsics(200, 200, 200.0, 200.0, 99.5, 99.5)
    plate = model_of(block((0.1, 0.1, 0.02)))
    alone = render_depth(plate, camera, pose.exp([0.0, 0.0, 0.6, 0.0, 0.0, 0.0]))
    depth = np.where(alone > 0, alone, np.float32(beyond))
    nowhere = np.zeros((200, 200), np.bool_)
    plane = np.array([0.0, 0.0, -1.0, beyond]) if on_plane else np.zeros(4)
    fx, fy, cx, cy = map(f4, (200, 200, 99.5, 99.5))
    grid = Grid(
        depth, np.zeros((3, 200, 200), np.float32), np.ones_like(depth), fx, fy, cx, cy,
        nowhere, (alone == 0) & on_plane, plane, np.zeros((0, 0), np.bool_),
    )  # fmt: skip
    return grid, viewpoint_model(plate)


@pytest.mark.parametrize(
    ("beyond", "on_plane", "kind"),
    [(0.0, False, RING_BINS - 1), (0.58, True, OFF_RING), (0.59, True, OFF_RING + 1),
     (0.6, True, OFF_RING + 2), (0.65, True, OFF_RING + 3), (0.5, False, 0), (0.58, False, 1),
     (0.59, False, 2), (0.6, False, 3), (0.62, False, 4), (0.7, False, 5)],
)  # fmt: skip
def test_what_lies_beyond_the_outline_decides_the_class_of_both_rings(beyond, on_plane, kind) -> None:
    T = pose.exp([0.0, 0.0, 0.6, 0.0, 0.0, 0.0])
    grid, model = plate_in_front_of(beyond, on_plane)
    counts = evidence(to_rows(T), model, grid, 0.6)[0]
    for ring in (counts[NEAR_RING], counts[FAR_RING]):
        assert ring[kind] > 0.1
        assert ring.sum() == ring[kind]


def test_what_lies_below_the_plane_is_told(scene) -> None:
    _, grid, truth = scene
    assert counted(scene)[BELOW] == 0.0
    sunk = truth.copy()
    sunk[:3, 3] -= 0.05 * grid.plane[:3]
    assert evidence(to_rows(sunk), scene[0], grid, truth[2, 3])[0][BELOW] > 0.1


def test_share_below_a_plane() -> None:
    vertices = np.array([[0, 0, 0], [0, 0, 0.05], [0, 0, -0.05], [0, 0, -0.008]], np.float32)
    at = to_rows(pose.exp([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]))
    assert below(at, vertices, np.array([0.0, 0.0, -1.0, 1.0]))[0] == 0.25  # up is towards the camera


def test_candidate_outside_of_the_image_counts_nothing(scene) -> None:
    assert counted(scene, x=5.0)[:BELOW].sum() == 0.0


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
        counts.append(evidence(to_rows(truth), model, observed.grid, truth[2, 3])[0][:RING].sum())
    assert counts[0] == pytest.approx(counts[1], rel=0.05)


def colored(scene, changes, **moves):
    """(steady, changing) edges of the visible outline."""
    model, grid, truth = scene
    counts = counted((model, grid._replace(changes=changes), truth), **moves)
    return counts[COLOR_STEADY], counts[COLOR_CHANGES]


@pytest.mark.parametrize("block", [1, 2, 4])
def test_colours_are_looked_at_along_the_visible_outline_only(scene, block) -> None:
    model, grid, truth = scene
    height, width = grid.depth.shape
    steady = np.zeros((block * (height - 2), block * (width - 2)), np.bool_)
    edges, none = colored(scene, steady)
    assert none == 0.0 < edges < 0.4 * inside(counted(scene)).sum()
    assert colored(scene, ~steady) == (0.0, edges)
    hidden = model, grid._replace(depth=np.where(grid.depth > 0, f4(0.3), f4(0.0))), truth
    assert sum(colored(hidden, steady)) < 0.1 * edges
    known = model, grid._replace(known=np.ones_like(grid.known)), truth
    assert colored(known, steady) == (0.0, 0.0)


def test_edges_too_near_to_the_border_of_the_image_to_be_looked_up_are_not_counted(scene) -> None:
    """The object is half out of the picture: what is its outline there is where the picture ends."""
    model, grid, truth = scene
    cut = grid._replace(cx=f4(1.5))
    height, width = grid.depth.shape
    changing = np.zeros((height - 2, width - 2), np.bool_)
    changing[BORDER:-BORDER, BORDER:-BORDER] = True
    steady, changes = colored((model, cut, truth), changing)
    assert steady == 0.0 < changes


def test_without_a_colour_image_nothing_is_counted(scene) -> None:
    assert scene[1].changes.size == 0
    assert counted(scene)[COLOR_STEADY] == counted(scene)[COLOR_CHANGES] == 0.0


@pytest.mark.parametrize("block", [1, 2, 4])
def test_the_truth_ends_where_the_colour_changes(scene, block) -> None:
    grid = scene[1]
    height, width = grid.depth.shape
    camera = Intrinsics(width, height, *map(float, (grid.fx, grid.fy, grid.cx, grid.cy)))
    shape = render_depth(standing_tool().model, camera, standing_tool().truth)[1:-1, 1:-1] > 0
    fine = np.kron(shape, np.ones((block, block), np.bool_))
    changes = np.zeros(fine.shape, np.bool_)
    for axis in range(2):
        step = np.diff(fine, axis=axis) != 0
        changes[tuple(slice(0, size) for size in step.shape)] |= step
    steady, changing = colored(scene, changes)
    assert changing > 0.9 * (steady + changing)
    steady, changing = colored(scene, changes, x=0.02)
    assert changing < 0.6 * (steady + changing)
