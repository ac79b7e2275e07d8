"""What speaks for a pose beside the confidence: unread depth agrees, and nothing else fits as well."""

import numpy as np
import pytest

from registration_core import Intrinsics, SnapConfig, snap
from registration_core.config import ParticleFilterConfig
from registration_core.geometry import pose
from registration_core.geometry.kernels import centred
from registration_core.judge.certificates import NOTHING, Check, certified, checked_by
from registration_core.rendering.rasterizer import render_depth
from registration_core.search.observation import is_held_out
from registration_core.search.viewpoint_model import viewpoint_model
from tests.registration_core.simple_scene import SimpleScene, block, model_of, nearest, noisy, tool

CAMERA = Intrinsics(640, 480, 525.0, 525.0, 319.5, 239.5)
GOOD = Check(500, 0.9, 0.97, 0.0, 0.0, 0.01, 0.013)
BAD = Check(500, 0.9, 0.6, 0.3, 0.02, 0.0, 0.0)
HIDDEN = Check(500, 0.1, 0.4, 0.6, 0.02, 0.0, 0.0)


@pytest.fixture(scope="module")
def scene() -> SimpleScene:
    """The tool on a table, large enough in the image for that to be reduced."""
    T_camera_table = pose.exp([0.0, 0.12, 0.85, np.radians(-125.0), 0.0, 0.0])
    truth = T_camera_table @ pose.exp([0.02, 0.0, 0.035, 0.0, 0.0, 0.6])
    table = model_of(block((1.2, 1.2, 0.02), (0.0, 0.0, -0.01)))
    drawn = nearest(render_depth(table, CAMERA, T_camera_table), render_depth(tool(), CAMERA, truth))
    return SimpleScene(tool(), noisy(drawn), CAMERA, truth)


def check(scene: SimpleScene, T, depth=None, held_out=True, explained=None) -> Check:
    model = viewpoint_model(scene.model)
    image = scene.depth if depth is None else depth.astype(np.float32)
    return checked_by(image, scene.camera, model, centred(T, model.centre), held_out, explained)


def test_truth_agrees_and_a_shifted_pose_does_not(scene) -> None:
    right = check(scene, scene.truth)
    assert right.agrees
    assert right.seen > 0.95
    assert right.match > 0.95
    nearer = check(scene, pose.exp([0.0, 0.0, -0.025, 0.0, 0.0, 0.0]) @ scene.truth)
    assert not nearer.agrees
    assert nearer.behind > 0.9
    assert nearer.behind_by == pytest.approx(0.025, abs=0.004)
    farther = check(scene, pose.exp([0.0, 0.0, 0.02, 0.0, 0.0, 0.0]) @ scene.truth)
    assert not farther.agrees
    assert farther.before > 0.8
    assert farther.before_by == pytest.approx(0.02, abs=0.004)


def test_only_unread_pixels_are_looked_at(scene) -> None:
    read = ~is_held_out(*np.indices(scene.depth.shape))
    spoilt = np.where(read, 0.3, scene.depth)
    assert check(scene, scene.truth, spoilt) == check(scene, scene.truth)
    half, whole = check(scene, scene.truth), check(scene, scene.truth, held_out=False)
    assert whole.pixels == pytest.approx(2 * half.pixels, rel=0.02)


def test_what_hides_the_object_is_not_held_against_it(scene) -> None:
    rows = np.indices(scene.depth.shape)[0]
    middle = int(np.median(np.nonzero(render_depth(scene.model, CAMERA, scene.truth))[0]))
    covered = check(scene, scene.truth, np.where(rows < middle, 0.4, scene.depth))
    assert 0.3 < covered.seen < 0.7
    assert covered.agrees
    unmeasured = check(scene, scene.truth, np.where(rows < middle, 0.0, scene.depth))
    assert unmeasured.seen == covered.seen
    nothing = check(scene, scene.truth, np.zeros_like(scene.depth))
    assert (nothing.seen, nothing.is_enough, nothing.agrees) == (0.0, False, False)


def test_a_known_object_is_no_part_of_what_is_sought(scene) -> None:
    known = np.ones(scene.depth.shape, dtype=bool)
    assert check(scene, scene.truth, explained=known).seen == 0.0
    nearer = pose.exp([0.0, 0.0, -0.025, 0.0, 0.0, 0.0]) @ scene.truth
    assert check(scene, nearer, explained=known).behind > 0.9  # the sensor saw through all the same


def test_outside_the_image_there_is_nothing_to_look_at(scene) -> None:
    assert check(scene, pose.exp([3.0, 0.0, 0.0, 0.0, 0.0, 0.0]) @ scene.truth) == NOTHING


def test_a_view_that_disagrees_outweighs_those_that_agree() -> None:
    assert certified(True, False, [GOOD]).observably_correct
    assert certified(True, False, [NOTHING], [GOOD]).observably_correct
    contradicted = certified(True, False, [GOOD], [HIDDEN, GOOD, BAD])
    assert not contradicted.observably_correct
    assert (contradicted.check, contradicted.views) == (BAD, 2)
    blind = certified(True, False, [HIDDEN], [NOTHING])
    assert (blind.observably_correct, blind.check, blind.views) == (False, HIDDEN, 0)


def test_without_result_there_is_no_certificate() -> None:
    neither = certified(False, False, [GOOD])
    assert not neither.observably_correct
    assert not neither.non_degenerate
    assert certified(True, False, [GOOD]).non_degenerate
    assert not certified(True, True, [GOOD]).non_degenerate


def test_a_snap_comes_with_its_certificates(scene) -> None:
    start = pose.perturbed(scene.truth, 0.02, 0.2, np.random.default_rng(1))
    estimate = snap(scene.model, scene.depth, CAMERA, start, rng=np.random.default_rng(0))
    assert estimate.certificates.observably_correct
    assert estimate.certificates.non_degenerate
    assert estimate.certificates.check.pixels > 500
    empty = np.where(scene.depth > 0, np.float32(3.0), 0.0)
    lost = snap(scene.model, empty, CAMERA, start, rng=np.random.default_rng(0))
    assert not lost.certificates.observably_correct
    assert not lost.certificates.non_degenerate


def test_where_all_pixels_were_read_none_is_left_to_check_by(scene) -> None:
    small = Intrinsics(160, 120, 131.25, 131.25, 79.875, 59.875)
    start = pose.perturbed(scene.truth, 0.005, 0.05, np.random.default_rng(1))
    estimate = snap(scene.model, scene.depth[::4, ::4], small, start, rng=np.random.default_rng(0))
    assert estimate.certificates.check == NOTHING
    assert not estimate.certificates.observably_correct
    paper = SnapConfig(method="particle_filter", particle_filter=ParticleFilterConfig(20, 2))
    filtered = snap(scene.model, scene.depth, CAMERA, scene.truth, paper, np.random.default_rng(0))
    assert filtered.certificates.check == NOTHING
