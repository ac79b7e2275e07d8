"""Weights by which right candidates win: a softmax over the candidates of each trial, ridge, known signs."""

import os
from collections.abc import Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from registration_core.judge import pixel_evidence as evidence
from registration_core.judge.selection import match_shares

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

RIDGES = (0.0003, 0.001, 0.003, 0.01, 0.03, 0.1)
"""Penalties on the squared weights of features scaled to unit variance, per trial, that are tried."""


@dataclass(frozen=True, eq=False)
class Choice:
    """The candidates of one trial, N of them."""

    features: Array
    """(N, F), as `judged_features` gives them."""
    right: Flags
    """(N,), whether the mean distance is small enough."""
    exact: Flags
    """(N,), whether the largest distance is, too."""

    @property
    def wanted(self) -> Flags:
        """(N,), which ones are to win: the exact ones, or the right ones where none is exact."""
        return self.exact if self.exact.any() else self.right


def judged_features(counts: Array, tails: Array) -> Array:
    """What the judgement of candidates is linear in, (N, COUNT + 2), of their counts (N, COUNT) and how far
    they are from the start (N,).
    """
    return np.column_stack([counts, match_shares(counts), -tails])


def signs() -> list[tuple[float | None, float | None]]:
    """Bounds of each weight, where it is known what a class must mean: what is hidden, seen through or below
    the plane never speaks for a pose, nor does an outline where the colour is steady; a match, nearness and a
    change of colour never speak against it.
    """
    bounds: list[tuple[float | None, float | None]] = [(None, None)] * (evidence.COUNT + 2)
    seen_through, seen_through_on_plane = evidence.OFF_BINS - 1, evidence.UNMEASURED - 1
    for part in (0, evidence.INSIDE_BINS):
        for against in (*evidence.HIDDEN, seen_through, seen_through_on_plane):
            bounds[part + against] = (None, 0.0)
    bounds[evidence.BELOW] = bounds[evidence.COLOR_STEADY] = (None, 0.0)
    bounds[evidence.COLOR_CHANGES] = (0.0, None)
    bounds[evidence.COUNT] = bounds[evidence.COUNT + 1] = (0.0, None)
    return bounds


def fitted_weights(
    choices: Sequence[Choice], ridge: float, removed: Collection[int] = (), start: Array | None = None
) -> Array:
    """Weights (F,) of the features: those that make the wanted candidates together most probable.

    Args:
        removed: features whose weights are 0.
        start: (F,), weights to begin with; the result is the same, but sooner there.
    """
    trials = _joined(choices)
    scale = trials.features.std(axis=0) + 1e-6
    scaled = replace(trials, features=trials.features / scale)

    def loss(weights: Array) -> tuple[float, Array]:
        values, slope = _surprise(scaled, weights)
        return float(values.mean()) + ridge / 2.0 * float(weights @ weights), slope + ridge * weights

    bounds = [(0.0, 0.0) if k in removed else bound for k, bound in enumerate(signs())]
    begin = np.zeros(len(scale)) if start is None else start * scale
    found = minimize(loss, begin, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": 500})
    return found.x / scale


def best_ridge(choices: Sequence[Choice], folds: Sequence[Flags]) -> float:
    """The strongest of RIDGES that predicts left-out trials as well as the best one does, within its standard
    error (Breiman et al., "Classification and Regression Trees", 1984): what comes later is farther from what
    was fitted to than any fold.
    """
    surprises = [left_out_surprises(choices, folds, ridge)[0] for ridge in RIDGES]
    best = min(surprises, key=np.mean)
    enough = best.mean() + best.std() / np.sqrt(len(best))
    return max(ridge for ridge, values in zip(RIDGES, surprises, strict=True) if values.mean() <= enough)


def needless(choices: Sequence[Choice], folds: Sequence[Flags], ridge: float) -> list[int]:
    """Classes without which left-out trials are predicted as well, tried from the least telling one on."""
    spread = _joined(choices).features.std(axis=0)
    telling = np.abs(fitted_weights(choices, ridge)) * spread
    values, weights = left_out_surprises(choices, folds, ridge)
    least, removed = values.mean(), list[int]()
    for k in np.argsort(telling[: evidence.COUNT], kind="stable").tolist():
        values, without = left_out_surprises(choices, folds, ridge, [*removed, k], weights)
        if values.mean() <= least:
            least, weights, removed = values.mean(), without, [*removed, k]
    return sorted(removed)


def left_out_surprises(
    choices: Sequence[Choice],
    folds: Sequence[Flags],
    ridge: float,
    removed: Collection[int] = (),
    starts: Sequence[Array | None] | None = None,
) -> tuple[Array, list[Array]]:
    """Negative log-probability of the wanted candidates, for each trial of each fold that is left out of a
    fit, and the weights of each fit.

    Args:
        folds: masks over the trials (T,).
        starts: for each fold the weights to begin with.
    """

    def left_out(out: Flags, start: Array | None) -> tuple[Array, Array]:
        weights = fitted_weights(where(choices, ~out), ridge, removed, start)
        return _surprise(_joined(where(choices, out)), weights)[0], weights

    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        found = list(pool.map(left_out, folds, starts or [None] * len(folds)))
    return np.concatenate([values for values, _ in found]), [weights for _, weights in found]


def where(choices: Sequence[Choice], mask: Flags) -> list[Choice]:
    """The choices that a mask (T,) keeps."""
    return [one for one, kept in zip(choices, mask, strict=True) if kept]


@dataclass(frozen=True, eq=False)
class _Joined:
    """Candidates of all trials in which something is to be chosen, one after the other."""

    features: Array
    """(N, F)."""
    wanted: Flags
    """(N,)."""
    first: NDArray[np.intp]
    """(T,), where each trial begins."""
    trial: NDArray[np.intp]
    """(N,), the trial of each candidate."""


def _joined(choices: Sequence[Choice]) -> _Joined:
    usable = [one for one in choices if one.right.any() and not one.wanted.all()]
    lengths = np.array([len(one.right) for one in usable])
    return _Joined(
        features=np.concatenate([one.features for one in usable]),
        wanted=np.concatenate([one.wanted for one in usable]),
        first=np.concatenate([[0], np.cumsum(lengths)[:-1]]),
        trial=np.repeat(np.arange(len(usable)), lengths),
    )


def _surprise(trials: _Joined, weights: Array) -> tuple[Array, Array]:
    """Negative log-probability of the wanted candidates of each trial together (T,), and the gradient (F,) of
    its mean.
    """
    scores = trials.features @ weights
    likely = np.exp(scores - np.maximum.reduceat(scores, trials.first)[trials.trial])
    every = np.add.reduceat(likely, trials.first)
    good = np.maximum(np.add.reduceat(likely * trials.wanted, trials.first), 1e-30)
    pull = likely / every[trials.trial] - likely * trials.wanted / good[trials.trial]
    return np.log(every) - np.log(good), trials.features.T @ pull / len(trials.first)
