"""Niches, symmetric twins, distances between modes."""

import numpy as np

from registration_core.geometry import pose
from registration_core.geometry.kernels import from_rows, to_rows
from registration_core.search.modes import distances, distinct, move_to_nearest_twin

rng = np.random.default_rng(0)
POSES = to_rows(np.stack([pose.exp(rng.normal(scale=0.03, size=6) * [1, 1, 1, 8, 8, 8]) for _ in range(60)]))
HALF_TURN = np.diag([-1.0, -1.0, 1.0, 1.0])
SYMMETRIES = to_rows(np.stack([np.eye(4), HALF_TURN]))


def test_kept_modes_are_the_best_of_their_niches() -> None:
    scores = rng.normal(size=60).astype(np.float32)
    kept = distinct(POSES, scores, 100, 0.03, 0.3)
    assert kept[0] == scores.argmax()
    assert (np.diff(scores[kept]) <= 0).all()
    T = from_rows(POSES).astype(np.float64)
    for i in range(60):
        near = [pose.distance(T[i], T[k]) for k in kept]
        inside = [(d.translation / 0.03) ** 2 + (d.rotation / 0.3) ** 2 < 1.02 for d in near]
        assert any(inside)
        if i not in kept:
            assert max(scores[kept][inside]) >= scores[i]


def test_no_kept_mode_is_in_the_niche_of_another() -> None:
    kept = POSES[distinct(POSES, np.zeros(60, np.float32), 100, 0.02, 0.5)]
    assert 10 < len(kept) < 60
    assert len(distinct(kept, np.ones(len(kept), np.float32), 100, 0.02, 0.5)) == len(kept)
    T = from_rows(kept).astype(np.float64)
    apart = [pose.distance(a, b) for n, a in enumerate(T) for b in T[:n]]
    assert all((d.translation / 0.02) ** 2 + (d.rotation / 0.5) ** 2 > 0.98 for d in apart)


def test_no_more_modes_than_asked_for() -> None:
    assert len(distinct(POSES, np.zeros(60, np.float32), 7, 1e-6, 1e-6)) == 7


def test_twins_are_moved_next_to_the_start() -> None:
    start = pose.exp([0.0, 0.0, 0.5, 0.3, 0.2, 0.1])
    twins = to_rows(np.stack([start, start @ HALF_TURN]))
    move_to_nearest_twin(twins, SYMMETRIES, to_rows(start)[0])
    np.testing.assert_allclose(from_rows(twins), np.stack([start, start]), atol=1e-6)


def test_distances_are_those_of_the_points_least_over_twins() -> None:
    points = np.array([[0.1, 0, 0], [0, 0.05, 0], [0, 0, 0.02]], dtype=np.float32)
    poses = np.stack([np.eye(4), HALF_TURN, pose.exp([0.01, 0.02, 0, 0, 0, 0.3])])
    apart = np.empty((3, 3), np.float32)
    distances(to_rows(poses), points, SYMMETRIES, apart)
    expected = min(
        np.linalg.norm(pose.apply(S, points) - pose.apply(poses[2], points), axis=1).max()
        for S in (np.eye(4), HALF_TURN)
    )
    np.testing.assert_allclose(apart, apart.T)
    assert apart[0, 1] < 1e-6
    np.testing.assert_allclose(apart[0, 2], expected, rtol=1e-5)
