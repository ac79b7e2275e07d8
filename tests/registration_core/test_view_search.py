"""The moves of one snap: rounds as large as asked for, the best first, fewer proposals from a near start."""

import numpy as np
import pytest

from registration_core import SnapConfig
from registration_core.geometry import pose
from registration_core.search.snap_input import checked_problem
from registration_core.view_search import SHOWN, ViewSearch, ranked, search_of
from tests.registration_core.simple_scene import standing_tool


def search(spread=None, config=None) -> ViewSearch:
    """A search from 3 cm and 20 degrees off."""
    scene, config = standing_tool(), config or SnapConfig()
    start = pose.perturbed(scene.truth, 0.03, np.radians(20), np.random.default_rng(0))
    problem = checked_problem(scene.model, scene.depth, scene.camera, start, config, spread)
    return search_of(problem, np.random.default_rng(0))


def test_ranked_are_the_best_in_order_and_ties_keep_theirs() -> None:
    scores = np.array([0.1, 0.9, 0.5, 0.9, 0.3], np.float32)
    poses = np.arange(5, dtype=np.float32)[:, None, None] * np.ones((1, 3, 4), np.float32)
    for most in (1, 3, 5, 9):
        best, best_scores = ranked(poses, scores, most)
        np.testing.assert_array_equal(best[:, 0, 0], [1, 3, 2, 4, 0][:most])
        np.testing.assert_array_equal(best_scores, np.sort(scores)[::-1][:most])


def test_a_round_proposes_and_then_leaves_fewer_and_fewer_modes() -> None:
    proposals, *modes = search().round(1.0)
    stages = SnapConfig().stages
    assert len(proposals) == SHOWN
    assert [len(poses) for poses in modes] == [
        min(len(before), stage.modes)
        for before, stage in zip([range(SnapConfig().wide_kept), *modes], stages, strict=False)
    ]


def test_a_round_of_a_share_costs_about_that_share() -> None:
    whole, part = search(), search()
    *_, most = whole.round(1.0)
    *_, some = part.round(0.25)
    assert part.evaluations == pytest.approx(0.25 * whole.evaluations, rel=0.1)
    assert len(some) == len(most) // 4


def test_a_wider_round_proposes_farther_off() -> None:
    off = []
    for widening in (1.0, 2.0):
        one = search()
        proposals = next(one.round(1.0, widening))
        off.append(np.median(np.linalg.norm(proposals[:, :, 3] - proposals[0, :, 3], axis=1)))
    assert off[1] > 1.2 * off[0]


@pytest.mark.parametrize("share", [0.0, -3.0, 1e-9, 1e9])
def test_a_share_that_is_none_still_gives_a_round(share) -> None:
    *_, modes = search().round(share)
    assert 1 <= len(modes) <= SnapConfig().stages[-1].modes


def test_fewer_are_proposed_from_a_start_that_is_said_to_be_close() -> None:
    counts = []
    for spread in (None, (0.04, 0.5), (0.02, 0.5), (0.003, 0.05)):
        one = search(spread)
        next(one.round(1.0))
        counts.append(one.evaluations)
    proposals = SnapConfig().proposals
    assert counts == [
        proposals.count, proposals.count, proposals.count // 2, round(proposals.least_share * proposals.count)
    ]  # fmt: skip


def test_best_mode_of_a_round_is_the_pose() -> None:
    one = search()
    *_, modes = one.round(1.0)
    truth = standing_tool().truth
    found = one.problem.uncentred(np.vstack([modes[0], [0, 0, 0, 1]]).astype(np.float64))
    assert pose.distance(found, truth).translation < 0.003
    assert pose.distance(found, truth).rotation < np.radians(2.0)
