"""The winner must earn its place."""

import numpy as np
import pytest

from registration_core import SnapConfig
from registration_core.geometry import pose
from registration_core.geometry.kernels import centred, f4, to_rows
from registration_core.judge.pixel_evidence import COUNT, evidence
from registration_core.judge.selection import chosen, judge, leads, match_shares, scores, shown_shares
from registration_core.search.observation import observe
from registration_core.search.sparse_score import Prior
from registration_core.search.viewpoint_model import viewpoint_model
from tests.registration_core.simple_scene import standing_tool


@pytest.fixture(scope="module")
def scene():
    """(viewpoint model, grid, T_camera_centre) of the standing tool."""
    scene = standing_tool()
    model = viewpoint_model(scene.model)
    truth = centred(scene.truth, model.centre)
    config = SnapConfig().observation
    grid = observe(scene.depth, scene.camera, truth[:3, 3], model, config, np.random.default_rng(0)).grid
    return model, grid, truth


def shifted(T, x=0.0, z=0.0):
    moved = T.copy()
    moved[[0, 2], 3] += [x, z]
    return moved


def judged(candidates, model, grid, prior, config):
    """The judgement among a start, one polish of it, and other modes."""
    counts = evidence(candidates, model, grid, prior.start[2, 3])
    return judge(candidates, counts, 1, prior, config)


def start_at(T):
    return Prior(to_rows(T)[0], f4(0.04), f4(0.5))


def test_true_mode_replaces_a_wrong_start(scene) -> None:
    model, grid, truth = scene
    start = pose.perturbed(truth, 0.05, 0.4, np.random.default_rng(0))
    candidates = to_rows(np.stack([start, start, truth]))
    verdict = judged(candidates, model, grid, start_at(start), SnapConfig().selection)
    assert verdict.winner == 2
    assert verdict.scores[2] > verdict.scores[0]


def test_equals_leave_the_operator_in_place(scene) -> None:
    model, grid, truth = scene
    candidates = to_rows(np.stack([truth, truth, shifted(truth, x=0.001)]))
    assert judged(candidates, model, grid, start_at(truth), SnapConfig().selection).winner == 0


def test_good_start_is_not_given_up_for_a_far_mode(scene) -> None:
    model, grid, truth = scene
    far = [pose.perturbed(truth, 0.06, 1.0, np.random.default_rng(k)) for k in range(20)]
    candidates = to_rows(np.stack([truth, truth, *far]))
    assert judged(candidates, model, grid, start_at(truth), SnapConfig().selection).winner == 0


def test_more_lead_is_demanded_over_a_start_that_fits(scene) -> None:
    model, grid, truth = scene
    config = SnapConfig().selection
    poses = to_rows(np.stack([truth, shifted(truth, x=0.002), shifted(truth, x=0.04)]))
    fitting, _, astray = evidence(poses, model, grid, truth[2, 3])
    np.testing.assert_array_equal(
        leads(poses, fitting, config), [config.lead, config.lead, config.lead_over_fit]
    )
    share = match_shares(astray[None])[0] / config.fit_match
    assert 0.0 < share < 1.0
    np.testing.assert_allclose(leads(poses[::-1], astray, config), config.lead * share)


def test_a_start_that_claims_nothing_measured_is_left_for_anything_better(scene) -> None:
    model, grid, truth = scene
    config = SnapConfig().selection
    poses = to_rows(np.stack([shifted(truth, z=-0.1), truth, truth]))
    unseen = grid._replace(depth=np.zeros_like(grid.depth))
    nothing = evidence(poses[:1], model, unseen, truth[2, 3])[0]
    np.testing.assert_array_equal(leads(poses, nothing, config), 0.0)


def test_the_winner_leads_by_what_is_demanded_of_it() -> None:
    scores = np.array([1.0, 2.5, 4.0])
    assert chosen(scores, 1, np.array([0.0, 1.0, 1.0])) == 2
    assert chosen(scores, 1, np.array([0.0, 1.0, 2.0])) == 1
    assert chosen(scores, 1, np.array([0.0, 2.0, 4.0])) == 0


def test_share_that_matches_falls_with_the_distance_from_the_truth(scene) -> None:
    model, grid, truth = scene
    poses = to_rows(np.stack([truth, shifted(truth, x=0.01), shifted(truth, x=0.04)]))
    shares = match_shares(evidence(poses, model, grid, truth[2, 3]))
    assert shares[0] > 0.8
    assert shares[0] > shares[1] > shares[2]


def test_what_is_hidden_does_not_count_against_the_share_that_matches(scene) -> None:
    model, grid, truth = scene
    hidden = grid.depth.copy()
    column = int(grid.fx * truth[0, 3] / truth[2, 3] + grid.cx)
    hidden[:, :column] = np.where(hidden[:, :column] > 0, 0.3, 0)
    whole, half = (
        match_shares(evidence(to_rows(truth), model, grid._replace(depth=depth), truth[2, 3]))[0]
        for depth in (grid.depth, hidden)
    )
    assert half > 0.9 * whole


def test_share_that_is_shown_is_that_of_the_outline_which_nothing_hides(scene) -> None:
    model, grid, truth = scene
    hidden = grid.depth.copy()
    column = int(grid.fx * truth[0, 3] / truth[2, 3] + grid.cx)
    hidden[:, :column] = 0.3
    whole, half, none = (
        shown_shares(evidence(to_rows(truth), model, grid._replace(depth=depth), truth[2, 3]))[0]
        for depth in (grid.depth, hidden, np.full_like(hidden, 0.3))
    )
    assert whole > 0.97
    assert 0.3 < half < 0.7
    assert none == 0.0


def test_a_score_does_not_depend_on_what_else_is_judged() -> None:
    rng, config = np.random.default_rng(0), SnapConfig().selection
    counts, tails = rng.random((400, COUNT)), rng.random(400)
    alone = [scores(counts[[k]], tails[[k]], config)[0] for k in range(400)]
    assert scores(counts, tails, config).tolist() == alone
