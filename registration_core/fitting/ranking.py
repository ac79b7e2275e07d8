"""Weights by which right candidates win: a softmax over the candidates of each trial, ridge, known signs."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from registration_core import evidence
from registration_core.selection import match_shares

Array = NDArray[np.float64]

RIDGES = (0.0003, 0.001, 0.003, 0.01, 0.03)
"""Penalties on the squared weights of features scaled to unit variance, per trial, that are tried."""


@dataclass(frozen=True, eq=False)
class Choice:
    """The candidates of one trial, N of them, and which are right."""

    features: Array
    """(N, F), as `judged_features` gives them."""
    right: NDArray[np.bool_]
    """(N,)."""


def judged_features(counts: Array, tails: Array) -> Array:
    """What the judgement of candidates is linear in, (N, COUNT + 2), of their counts (N, COUNT) and how far
    they are from the start (N,).
    """
    return np.column_stack([counts, match_shares(counts), -tails])


def signs() -> list[tuple[float | None, float | None]]:
    """Bounds of each weight, where it is known what a class must mean: what is hidden, seen through or below
    the plane never speaks for a pose, a match and nearness never against it.
    """
    bounds: list[tuple[float | None, float | None]] = [(None, None)] * (evidence.COUNT + 2)
    seen_through, seen_through_on_plane = evidence.OFF_BINS - 1, evidence.UNMEASURED - 1
    for part in (0, evidence.INSIDE_BINS):
        for against in (*evidence.HIDDEN, seen_through, seen_through_on_plane):
            bounds[part + against] = (None, 0.0)
    bounds[evidence.BELOW] = (None, 0.0)
    bounds[evidence.COUNT] = bounds[evidence.COUNT + 1] = (0.0, None)
    return bounds


def fitted_weights(choices: Sequence[Choice], ridge: float) -> Array:
    """Weights (F,) of the features: those that make the right candidates together most probable."""
    trials = _joined(choices)
    scale = trials.features.std(axis=0) + 1e-6
    scaled = replace(trials, features=trials.features / scale)

    def loss(weights: Array) -> tuple[float, Array]:
        value, slope = _surprise(scaled, weights)
        return value + ridge / 2.0 * float(weights @ weights), slope + ridge * weights

    start = np.zeros(len(scale))
    found = minimize(loss, start, jac=True, method="L-BFGS-B", bounds=signs(), options={"maxiter": 500})
    return found.x / scale


def best_ridge(choices: Sequence[Choice], folds: Sequence[NDArray[np.bool_]]) -> float:
    """The one of RIDGES by which trials that were left out, fold by fold, are predicted best."""

    def surprise(ridge: float) -> float:
        return sum(left_out_surprise(choices, out, ridge) for out in folds)

    return min(RIDGES, key=surprise)


def left_out_surprise(choices: Sequence[Choice], out: NDArray[np.bool_], ridge: float) -> float:
    """Mean negative log-probability of the right candidates in trials (T,) that are left out of the fit."""
    weights = fitted_weights(where(choices, ~out), ridge)
    return _surprise(_joined(where(choices, out)), weights)[0]


def where(choices: Sequence[Choice], mask: NDArray[np.bool_]) -> list[Choice]:
    """The choices that a mask (T,) keeps."""
    return [one for one, kept in zip(choices, mask, strict=True) if kept]


@dataclass(frozen=True, eq=False)
class _Joined:
    """Candidates of all trials in which something is to be chosen, one after the other."""

    features: Array
    """(N, F)."""
    right: NDArray[np.bool_]
    """(N,)."""
    first: NDArray[np.intp]
    """(T,), where each trial begins."""
    trial: NDArray[np.intp]
    """(N,), the trial of each candidate."""


def _joined(choices: Sequence[Choice]) -> _Joined:
    usable = [one for one in choices if one.right.any() and not one.right.all()]
    lengths = np.array([len(one.right) for one in usable])
    return _Joined(
        features=np.concatenate([one.features for one in usable]),
        right=np.concatenate([one.right for one in usable]),
        first=np.concatenate([[0], np.cumsum(lengths)[:-1]]),
        trial=np.repeat(np.arange(len(usable)), lengths),
    )


def _surprise(trials: _Joined, weights: Array) -> tuple[float, Array]:
    """Mean negative log-probability of the right candidates of each trial together, and its gradient (F,)."""
    scores = trials.features @ weights
    likely = np.exp(scores - np.maximum.reduceat(scores, trials.first)[trials.trial])
    every = np.add.reduceat(likely, trials.first)
    good = np.maximum(np.add.reduceat(likely * trials.right, trials.first), 1e-30)
    value = np.mean(np.log(every) - np.log(good))
    pull = likely / every[trials.trial] - likely * trials.right / good[trials.trial]
    return float(value), trials.features.T @ pull / len(trials.first)
