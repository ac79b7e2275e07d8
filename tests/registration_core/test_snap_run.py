"""One view is its search; several add up what each of them says, wherever its camera stands."""

import numpy as np
import pytest

from registration_core import SnapConfig
from registration_core.geometry import pose
from registration_core.search.snap_input import checked_problem
from registration_core.snap_run import Sighting, SnapRun
from registration_core.view_search import search_of
from tests.registration_core.simple_scene import standing_tool


def run_of(*sightings: Sighting) -> SnapRun:
    return SnapRun(sightings, 0, 0.0)


def sighting(T_camera_first=None) -> Sighting:
    """The standing tool, from 1 cm and 6 degrees off."""
    scene = standing_tool()
    start = pose.perturbed(scene.truth, 0.01, np.radians(6), np.random.default_rng(0))
    problem = checked_problem(scene.model, scene.depth, scene.camera, start, SnapConfig(), None)
    T = np.eye(4) if T_camera_first is None else T_camera_first
    return Sighting(search_of(problem, np.random.default_rng(0)), T)


def test_one_view_says_what_its_search_says() -> None:
    run = run_of(sighting())
    poses = run.polished_start()
    search = run.sightings[0].search
    np.testing.assert_array_equal(run.evidence(poses), search.evidence(poses))
    np.testing.assert_array_equal(run.hessian(poses[0]), search.systems(poses[:1], 0.006)[0][0])
    assert run.evaluations == search.evaluations


def test_the_same_view_twice_holds_twice_as_firmly_and_polishes_alike() -> None:
    one, two = run_of(sighting()), run_of(sighting(), sighting())
    poses = one.polished_start()
    np.testing.assert_allclose(two.evidence(poses), 2.0 * one.evidence(poses))
    np.testing.assert_allclose(two.hessian(poses[0]), 2.0 * one.hessian(poses[0]), rtol=1e-6)
    np.testing.assert_allclose(two.polished_start(), poses, atol=5e-4)


def test_what_holds_a_pose_is_told_in_the_first_cameras_axes() -> None:
    T_camera_first = pose.exp([0.1, -0.2, 0.3, 0.4, 0.5, -0.6])
    here, there = sighting(), sighting(T_camera_first)
    seen = run_of(here).polished_start()
    poses = there.found(seen)
    np.testing.assert_allclose(there.seen(poses), seen, atol=1e-6)
    hessian, turn = here.systems(seen, 0.006)[0], np.kron(np.eye(2), T_camera_first[:3, :3])
    np.testing.assert_allclose(there.systems(poses, 0.006)[0], turn.T @ hessian @ turn, rtol=2e-3, atol=1e-2)


def test_how_firmly_a_pose_is_held_does_not_depend_on_whose_axes_it_is_in() -> None:
    here, there = sighting(), sighting(pose.exp([0.1, -0.2, 0.3, 0.4, 0.5, -0.6]))
    seen = run_of(here).polished_start()
    spreads = run_of(here).spreads(seen)
    np.testing.assert_allclose(run_of(there).spreads(there.found(seen)), spreads, rtol=5e-3)
    np.testing.assert_allclose(run_of(here, here).spreads(seen), spreads / np.sqrt(2.0), rtol=5e-3)
    assert 0.001 < spreads[0] < 0.1


def test_the_proposals_of_a_round_are_shared_out_among_the_views() -> None:
    one, two = run_of(sighting()), run_of(sighting(), sighting())
    alone, shared = list(one.round(0.5, 1.0)), list(two.round(0.5, 1.0))
    assert len(alone) == len(shared)
    for ours, theirs in zip(shared[1:-1], alone[1:-1], strict=True):
        assert len(ours) == pytest.approx(len(theirs), abs=2)
    assert len(shared[-1]) <= len(alone[-1])
    counts = one.evidence(alone[-1])
    assert one.judge(alone[-1], counts).of_winner[0] == pytest.approx(
        two.judge(alone[-1], 2.0 * counts).of_winner[0]
    )
