"""Searches for fitting: repeatable, with the truth of each candidate."""

import numpy as np
import pytest

from registration_core.config import SnapConfig
from registration_core.fitting.replay import winner
from registration_core.fitting.trials import SHELLS, Trial, distances, scene_trials, start_on, true_model
from registration_core.geometry import pose


@pytest.fixture(scope="module")
def trials() -> list[Trial]:
    return scene_trials(0, 0)


@pytest.mark.slow
def test_a_scene_gives_the_same_trials_again(trials) -> None:
    again = scene_trials(0, 0)
    assert len(trials) == len(again) > 0
    for one, other in zip(trials, again, strict=True):
        np.testing.assert_array_equal(one.counts, other.counts)
        np.testing.assert_array_equal(one.right, other.right)


def test_a_trial_holds_every_round(trials) -> None:
    for trial in trials:
        assert trial.ends[0] == 1 + trial.near
        assert len(trial.ends) == 1 + len(SnapConfig().rounds)
        assert trial.ends[-1] == len(trial.poses) == len(trial.counts) == len(trial.right)
        best, scores = winner(trial, trial.ends[-1], SnapConfig().selection)
        assert 0 <= best < len(scores) == trial.ends[-1]


def test_exact_is_right_as_well(trials) -> None:
    assert any(trial.exact.any() for trial in trials)
    for trial in trials:
        assert (trial.right | ~trial.exact).all()


def test_distances_are_least_over_symmetries_and_copies() -> None:
    model = true_model("cube", 0)
    T = pose.exp([0.0, 0.0, 0.6, 0.0, 0.0, 0.0])
    quarter = T @ pose.exp([0, 0, 0, 0, 0, np.pi / 2])
    away = T @ pose.exp([0.02, 0, 0, 0, 0, 0])
    mean, largest = distances(np.stack([T, quarter, away]), [T], model)
    np.testing.assert_allclose(mean, [0, 0, 0.02], atol=1e-6)
    np.testing.assert_allclose(largest, [0, 0, 0.02], atol=1e-6)
    assert distances(away[None], [T, away], model)[0][0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("shell", range(len(SHELLS)))
def test_starts_lie_on_their_shell(shell) -> None:
    model = true_model("mug", 0)
    T = pose.exp([0.0, 0.0, 0.6, 0.3, 0.0, 0.0])
    start = start_on(shell, T, model, np.random.default_rng(0))
    moved = np.linalg.norm(pose.apply(start, model.centre) - pose.apply(T, model.centre))
    assert moved == pytest.approx(SHELLS[shell][0])
    assert pose.distance(start, T).rotation == pytest.approx(np.radians(SHELLS[shell][1]))
