"""What a snap decides from the candidates of a trial: after its polish, and after each round."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration_core.config import ConfidenceConfig, SelectionConfig
from registration_core.fitting.trials import Trial, told_model
from registration_core.geometry.kernels import Array32
from registration_core.judge import selection
from registration_core.judge.confidence import belief_in_first, grouped
from registration_core.search.viewpoint_model import ViewpointModel, viewpoint_model

Array = NDArray[np.float64]

TEMPERATURES = (0.5, 1.0)
"""That are tried for the softmax that shares the belief among modes."""


@dataclass(frozen=True, eq=False)
class Decision:
    """The winner among the candidates that one trial has so far."""

    trial: int
    rounds: int
    """That were searched."""
    beliefs: tuple[float, ...]
    """Near it, for each of TEMPERATURES."""
    score: float
    counts: Array
    """(COUNT,)."""
    spread: float
    """Of its surface."""
    right: bool
    exact: bool


def decisions(
    trials: Sequence[Trial], judge: SelectionConfig, confidence: ConfidenceConfig
) -> list[Decision]:
    """For each trial in turn, after the polish of the start and after every round."""
    return [
        _decision(number, trial, rounds, judge, confidence)
        for number, trial in enumerate(trials)
        for rounds in range(len(trial.ends))
    ]


def winner(trial: Trial, candidates: int, judge: SelectionConfig) -> tuple[int, Array]:
    """Which of the first candidates wins, and the scores of them all (candidates,)."""
    counts = trial.counts[:candidates]
    scores = selection.scores(counts, trial.tails[:candidates], judge)
    leads = selection.leads(trial.poses[:candidates], counts[0], judge)
    return selection.chosen(scores, trial.near, leads), scores


def _decision(
    number: int, trial: Trial, rounds: int, judge: SelectionConfig, confidence: ConfidenceConfig
) -> Decision:
    candidates = trial.ends[rounds]
    best, scores = winner(trial, candidates, judge)
    model = viewpoint_model(told_model(trial.kind, trial.variant))
    poses = trial.poses[:candidates]
    beliefs = [_belief(poses, best, scores / t, model, confidence) for t in TEMPERATURES]
    return Decision(
        trial=number,
        rounds=rounds,
        beliefs=tuple(beliefs),
        score=float(scores[best]),
        counts=trial.counts[best],
        spread=float(trial.spreads[best]),
        right=bool(trial.right[best]),
        exact=bool(trial.exact[best]),
    )


def _belief(
    poses: Array32, best: int, log_odds: Array, model: ViewpointModel, config: ConfidenceConfig
) -> float:
    modes = grouped(poses, best, log_odds, model, config)
    return belief_in_first(modes, poses[modes.best], model)
