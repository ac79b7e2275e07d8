"""What depth says of an object at a pose, where the answer is known."""

import numpy as np
import pytest

from registration_core import Intrinsics
from registration_core.geometry import pose
from registration_core.rendering.depth_verdicts import TOLERANCE, DepthAgreement, Verdict, depth_agreement
from registration_core.rendering.rasterizer import render_depth
from tests.registration_core.simple_scene import block, model_of, standing_tool

CAMERA = Intrinsics(200, 160, 250.0, 250.0, 99.5, 79.5)
BOX = model_of(block((0.10, 0.08, 0.04)))
HERE = pose.exp([0.0, 0.0, 0.6, 0.0, 0.0, 0.0])
"""The box before the camera, its front a rectangle at 0.58 m."""
DEPTH = render_depth(BOX, CAMERA, HERE)


def shifted(metres: float) -> np.ndarray:
    return pose.exp([0.0, 0.0, 0.6 + metres, 0.0, 0.0, 0.0])


def shares(agreement: DepthAgreement) -> dict[str, float]:
    found = {verdict.name: agreement.share(verdict) for verdict in Verdict}
    assert sum(found.values()) == pytest.approx(1.0)
    return {name: share for name, share in found.items() if share > 0}


def test_an_object_where_it_was_measured_matches_everywhere() -> None:
    agreement = depth_agreement(BOX, DEPTH, CAMERA, HERE)
    assert len(agreement.verdicts) == (DEPTH > 0).sum()
    assert shares(agreement) == {"MATCH": 1.0}
    assert agreement.inlier_share == 1.0
    assert agreement.median_residual == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("metres", "verdict"), [(-0.007, "IN_FRONT"), (0.007, "BEHIND"), (0.003, "MATCH")])
def test_a_shift_along_the_view_is_told_with_its_side(metres: float, verdict: str) -> None:
    larger = np.full_like(DEPTH, 0.58)  # so that the outline, which the shift changes, plays no part
    agreement = depth_agreement(BOX, larger, CAMERA, shifted(metres))
    assert shares(agreement) == {verdict: 1.0}
    assert agreement.gap == pytest.approx(-metres, abs=1e-6)
    if verdict == "MATCH":
        assert agreement.median_residual == pytest.approx(0.003, abs=1e-6)
    else:
        assert (agreement.inlier_share, agreement.median_residual) == (0.0, None)


def test_holes_are_no_data_and_no_evidence() -> None:
    holed = DEPTH.copy()
    holed[:, :100] = 0.0
    agreement = depth_agreement(BOX, holed, CAMERA, HERE)
    assert shares(agreement) == pytest.approx({"MATCH": 0.5, "NO_DATA": 0.5}, abs=0.02)
    assert agreement.inlier_share == 1.0
    assert depth_agreement(BOX, np.zeros_like(DEPTH), CAMERA, HERE).inlier_share is None


def test_what_stands_clearly_in_front_hides_and_is_no_evidence() -> None:
    hidden = DEPTH.copy()
    hidden[:80] = 0.3
    agreement = depth_agreement(BOX, hidden, CAMERA, HERE)
    assert shares(agreement) == pytest.approx({"MATCH": 0.5, "BEHIND": 0.5}, abs=0.02)
    assert agreement.inlier_share == 1.0  # of what can be seen
    hidden[:] = 0.3
    assert depth_agreement(BOX, hidden, CAMERA, HERE).inlier_share is None
    assert agreement.median_residual == pytest.approx(0.0, abs=1e-6)  # of the matches alone


def test_far_away_more_is_tolerated() -> None:
    at_two_metres = shifted(1.42)
    wall = np.full_like(DEPTH, 2.0 + 3 * TOLERANCE)
    assert shares(depth_agreement(BOX, wall, CAMERA, at_two_metres)) == {"MATCH": 1.0}


def test_an_object_out_of_the_image_has_no_numbers() -> None:
    for T in (pose.exp([3.0, 0.0, 0.6, 0.0, 0.0, 0.0]), shifted(-2.0)):
        agreement = depth_agreement(BOX, DEPTH, CAMERA, T)
        assert len(agreement.verdicts) == 0
        assert (agreement.inlier_share, agreement.median_residual) == (None, None)
        assert all(agreement.share(verdict) == 0.0 for verdict in Verdict)


def test_the_points_lie_on_the_surface() -> None:
    points = depth_agreement(BOX, DEPTH, CAMERA, HERE).points(CAMERA)
    assert points[:, 2] == pytest.approx(0.58)
    assert np.abs(points[:, :2]).max(axis=0) == pytest.approx([0.05, 0.04], abs=0.0025)


def test_a_noisy_scene_agrees_with_the_truth_alone() -> None:
    scene = standing_tool()
    truth = depth_agreement(scene.model, scene.depth, scene.camera, scene.truth)
    assert truth.inlier_share is not None and truth.inlier_share > 0.95
    assert truth.median_residual == pytest.approx(0.0005, abs=0.0005)
    off = scene.truth @ pose.exp([0.015, 0.0, 0.0, 0.0, 0.0, 0.2])
    share = depth_agreement(scene.model, scene.depth, scene.camera, off).inlier_share
    assert share is not None and share < 0.8
