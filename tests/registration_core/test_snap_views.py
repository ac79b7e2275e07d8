"""One pose against several views: exact where they agree, and better than the worst of them."""

import dataclasses

import numpy as np
import pytest

from registration_core import SnapConfig, snap, snap_views, snap_views_steps
from registration_core.estimate import WorldEstimate
from registration_core.geometry import pose
from registration_core.geometry.kernels import centred
from registration_core.rendering.rasterizer import render_depth
from tests.registration_core.simple_scene import CAMERA, block, model_of, nearest, noisy, tool

T_WORLD_OBJECT = pose.exp([0.02, 0.0, 0.035, 0.0, 0.0, 0.6])


def around(angle: float):
    """`T_world_camera` of a camera 0.8 m off that looks down on the table from a side."""
    T_camera_table = pose.exp([0.0, 0.12, 0.85, np.radians(-125.0), 0.0, 0.0])
    return pose.inverse(T_camera_table @ pose.exp([0.0, 0.0, 0.0, 0.0, 0.0, angle]))


def view(angle: float):
    """What that camera sees of the tool on the table."""
    T_camera_world = pose.inverse(around(angle))
    table = model_of(block((1.2, 1.2, 0.02), (0.0, 0.0, -0.01)))
    depths = (
        render_depth(table, CAMERA, T_camera_world),
        render_depth(tool(), CAMERA, T_camera_world @ T_WORLD_OBJECT),
    )
    return noisy(nearest(*depths)), CAMERA, around(angle)


@pytest.fixture(scope="module")
def views():
    return [view(angle) for angle in (0.0, 2.0, 4.0)]


def run(views, start, **options) -> WorldEstimate:
    return snap_views(tool(), views, start, rng=np.random.default_rng(0), **options)


@pytest.mark.parametrize("seed", range(4))
def test_recovers_the_pose_from_far_off(views, seed) -> None:
    start = pose.perturbed(T_WORLD_OBJECT, 0.06, np.radians(40), np.random.default_rng(seed))
    estimate = run(views, start)
    apart = pose.distance(estimate.T_world_object, T_WORLD_OBJECT)
    assert apart.translation < 0.003
    assert apart.rotation < np.radians(1.5)
    assert estimate.confidence > 0.9
    assert estimate.converged
    np.testing.assert_array_equal(estimate.T_camera_object, estimate.T_world_object)
    np.testing.assert_array_equal(estimate.hypotheses[0].T_camera_object, estimate.T_world_object)


def test_one_view_gives_what_snap_gives_to_the_last_bit() -> None:
    """Whatever the start: making a pose rigid twice may move it by one last digit, and the scores with it."""
    depth, camera, T_world_camera = view(0.0)
    T_camera_object, rng = pose.inverse(T_world_camera) @ T_WORLD_OBJECT, np.random.default_rng(0)
    starts = (pose.perturbed(T_camera_object, 0.05, 1.0, rng) for _ in range(99))
    start = next(T for T in starts if moves_when_made_rigid_twice(T))
    half = np.where(np.arange(depth.shape[1]) < depth.shape[1] // 2, depth, 0.0)  # leaves many hypotheses
    here = snap(tool(), half, camera, start, rng=np.random.default_rng(0))
    there = run([(half, camera, np.eye(4))], start)
    np.testing.assert_array_equal(there.T_camera_object, here.T_camera_object)
    assert [one.weight for one in there.hypotheses] == [one.weight for one in here.hypotheses]
    assert len(here.hypotheses) > 1
    assert there.confidence == here.confidence


def moves_when_made_rigid_twice(T: np.ndarray) -> bool:
    once = pose.checked(T, "once")
    depths = [centred(rigid, tool().centre)[2, 3] for rigid in (once, pose.checked(once, "twice"))]
    return depths[0] != depths[1]


def test_each_view_is_seen_in_its_own_colours(views) -> None:
    start = pose.perturbed(T_WORLD_OBJECT, 0.02, 0.3, np.random.default_rng(0))
    shapes = [render_depth(tool(), CAMERA, pose.inverse(T) @ T_WORLD_OBJECT) > 0 for _, _, T in views[:2]]
    colors = [np.where(shape[..., None], (200, 60, 40), (60, 70, 80)).astype(np.uint8) for shape in shapes]
    ways = (colors, [colors[0], None], [None, colors[1]], colors[::-1], None)
    sure = [run(views[:2], start, colors=way).confidence for way in ways]
    assert len(set(sure)) == len(ways)
    assert sure[0] == max(sure)


def test_more_views_leave_less_doubt(views) -> None:
    start = pose.perturbed(T_WORLD_OBJECT, 0.01, 0.1, np.random.default_rng(0))
    one, three = run(views[:1], start), run(views, start)
    assert np.trace(three.covariance) < 0.7 * np.trace(one.covariance)
    np.testing.assert_allclose(three.covariance, three.covariance.T)


def test_same_seed_same_estimate(views) -> None:
    start = pose.perturbed(T_WORLD_OBJECT, 0.03, 0.3, np.random.default_rng(1))
    first, again = run(views[:2], start), run(views[:2], start)
    np.testing.assert_array_equal(first.T_world_object, again.T_world_object)
    assert first.seed == again.seed == 0


def test_one_view_is_a_snap(views) -> None:
    depth, camera, T_world_camera = views[0]
    start = pose.perturbed(T_WORLD_OBJECT, 0.03, 0.3, np.random.default_rng(1))
    T_start = pose.inverse(T_world_camera) @ start
    one = snap(tool(), depth, camera, T_start, rng=np.random.default_rng(0))
    here = run([(depth, camera, np.eye(4))], T_start)
    np.testing.assert_array_equal(here.T_camera_object, one.T_camera_object)
    np.testing.assert_array_equal(here.covariance, one.covariance)
    assert (here.confidence, here.evaluations) == (one.confidence, one.evaluations)
    there = run(views[:1], start)
    np.testing.assert_allclose(there.T_world_object, T_world_camera @ one.T_camera_object, atol=1e-12)
    turn = np.kron(np.eye(2), T_world_camera[:3, :3])
    np.testing.assert_allclose(there.covariance, turn @ one.covariance @ turn.T, atol=1e-12)


def test_steps_lead_to_the_estimate_in_the_world(views) -> None:
    start = pose.perturbed(T_WORLD_OBJECT, 0.06, np.radians(40), np.random.default_rng(0))
    rounds = tuple(dataclasses.replace(one, doubt=1.0) for one in SnapConfig().rounds)
    config = SnapConfig(rounds=rounds)
    steps = list(snap_views_steps(tool(), views, start, config, np.random.default_rng(0)))
    assert len(steps) > 2
    assert [step.iteration for step in steps] == list(range(1, len(steps) + 1))
    assert all(step.iteration <= step.iterations for step in steps)
    assert all(step.estimate is None for step in steps[:-1])
    for step in steps:
        np.testing.assert_allclose(step.particles[0], step.T_camera_object, atol=1e-6)
        assert pose.distance(step.T_camera_object, T_WORLD_OBJECT).translation < 0.07
    estimate = steps[-1].estimate
    assert isinstance(estimate, WorldEstimate)
    np.testing.assert_array_equal(estimate.T_world_object, run(views, start, config=config).T_world_object)


def test_the_first_round_alone_is_searched_where_the_start_fits_in_all_views(views) -> None:
    start = pose.perturbed(T_WORLD_OBJECT, 0.003, np.radians(2), np.random.default_rng(0))
    steps = list(snap_views_steps(tool(), views, start, rng=np.random.default_rng(0)))
    a_round = 1 + len(SnapConfig().stages)
    assert len(steps) == 1 + a_round + 1
    estimate = steps[-1].estimate
    assert isinstance(estimate, WorldEstimate)
    assert pose.distance(estimate.T_world_object, T_WORLD_OBJECT).translation < 0.003


def test_known_objects_are_left_out_of_the_view_that_shows_them(views) -> None:
    start = pose.perturbed(T_WORLD_OBJECT, 0.02, 0.2, np.random.default_rng(2))
    everything = np.ones(views[1][0].shape, dtype=bool)
    with_it = run(views[:2], start, explained=[None, everything])
    np.testing.assert_array_equal(with_it.T_world_object, run(views[:1], start).T_world_object)


def test_views_that_are_not_used_say_whether_they_agree(views) -> None:
    start = pose.perturbed(T_WORLD_OBJECT, 0.02, 0.2, np.random.default_rng(2))
    depth, camera, T = views[2]
    without_it = (np.where(depth > 0, np.float32(2.0), 0.0), camera, T)
    away = (depth, camera, T @ pose.exp([0.0, 0.0, 0.0, 0.0, np.pi, 0.0]))
    estimate = run([*views[:2], views[2], without_it, away], start, used=2)
    np.testing.assert_array_equal(estimate.T_world_object, run(views[:2], start).T_world_object)
    agreeing, seen_through, blind = estimate.certificates.unused
    assert agreeing.agrees
    assert agreeing.match > 0.95
    assert not seen_through.agrees
    assert seen_through.behind == 1.0
    assert not blind.is_enough
    assert estimate.certificates.views == 2
    assert not estimate.certificates.observably_correct
    assert run(views, start, used=2).certificates.observably_correct


def test_far_from_the_origin_of_the_world_is_as_exact(views) -> None:
    start = pose.perturbed(T_WORLD_OBJECT, 0.03, 0.3, np.random.default_rng(1))
    away = pose.exp([4e5, -5e6, 300.0, 0.0, 0.0, 1.0])
    moved = [(depth, camera, away @ T) for depth, camera, T in views]
    estimate = run(moved, away @ start)
    assert pose.distance(estimate.T_world_object, away @ T_WORLD_OBJECT).translation < 0.003


def test_views_that_do_not_show_the_object_are_left_out(views) -> None:
    start = pose.perturbed(T_WORLD_OBJECT, 0.02, 0.2, np.random.default_rng(2))
    depth, camera, T_world_camera = views[1]
    away = T_world_camera @ pose.exp([0.0, 0.0, 0.0, 0.0, np.pi, 0.0])
    with_it, without = run([views[0], (depth, camera, away)], start), run(views[:1], start)
    np.testing.assert_array_equal(with_it.T_world_object, without.T_world_object)


def test_hidden_object_keeps_the_operators_pose(views) -> None:
    start = pose.perturbed(T_WORLD_OBJECT, 0.01, 0.1, np.random.default_rng(0))
    walls = [(np.full_like(depth, 0.3), camera, T) for depth, camera, T in views]
    estimate = run(walls, start)
    np.testing.assert_allclose(estimate.T_world_object, start, atol=1e-6)
    assert estimate.confidence < 0.1
    assert not estimate.converged


def test_bad_input_is_named(views) -> None:
    depth, camera, T = views[0]
    outside = pose.exp([0.0, 0.0, -5.0, 0.0, 0.0, 0.0])
    for start, given, options, message in (
        (T_WORLD_OBJECT, [], {}, "views must"),
        (T_WORLD_OBJECT, [(depth[:5], camera, T)], {}, r"views\[0\]: depth must have the shape"),
        (T_WORLD_OBJECT, [(depth, camera, 2.0 * T)], {}, r"views\[0\]: T_world_camera must"),
        (outside, [(depth, camera, T)], {}, "T_world_object puts the object wholly outside"),
        (T_WORLD_OBJECT, views, {"config": SnapConfig.paper()}, "config.method must"),
        (T_WORLD_OBJECT, views, {"used": 0}, "used must be from 1"),
        (T_WORLD_OBJECT, views, {"used": 4}, "used must be from 1"),
        (T_WORLD_OBJECT, [views[0], (depth[:5], camera, T)], {"used": 1}, r"views\[1\]: depth must have"),
        (T_WORLD_OBJECT, [(depth, camera, T)], {"explained": []}, "explained must hold"),
        (T_WORLD_OBJECT, [(depth, camera, T)], {"explained": [depth > 0.5, None]}, "explained must hold"),
        (T_WORLD_OBJECT, [(depth, camera, T)], {"colors": []}, "colors must hold"),
        (T_WORLD_OBJECT, [(depth, camera, T)], {"colors": [depth]}, r"views\[0\]: color must be"),
        (T_WORLD_OBJECT, [(depth, camera, T)], {"explained": [depth]}, r"views\[0\]: explained must be"),
    ):
        with pytest.raises(ValueError, match=message):
            run(given, start, **options)
