"""Means over operators with percentile bootstrap intervals (Efron and Tibshirani, 1993)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEVEL = 0.95
RESAMPLES = 2000


class Interval(NamedTuple):
    """A mean over operators and how sure it is."""

    mean: float
    low: float
    high: float
    """Bounds of the 95 % interval; NaN for less than two operators."""
    operators: int


@dataclass(frozen=True, eq=False)
class ByOperator:
    """Values of each operator, averaged over the operator's own trials."""

    means: Array
    """(O, K), over the trials that have one; NaN where none has."""
    trials: NDArray[np.intp]
    """(O, K), how many have one."""
    shares: Array
    """(O, K), of all the operator's trials."""


def by_operator(values: Array, operators: Sequence[str]) -> ByOperator:
    """Average values (T, K) of trials, NaN for none, over each of their operators (T,), in their order."""
    names, index = np.unique(np.asarray(operators), return_inverse=True)
    member = np.arange(len(names))[:, None] == index
    has = np.isfinite(values)
    trials = member.astype(np.intp) @ has.astype(np.intp)
    sums = member.astype(np.float64) @ np.where(has, values, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return ByOperator(sums / trials, trials, trials / member.sum(axis=1)[:, None])


def resampled_means(values: Array, seed: int, resamples: int = RESAMPLES) -> Array:
    """Means (B, K) over operators drawn with replacement, of values (O, K), each over those that have one."""
    count = len(values)
    draws = np.random.default_rng(seed).multinomial(count, np.full(count, 1.0 / count), size=resamples)
    has = np.isfinite(values)
    with np.errstate(invalid="ignore"):
        return (draws @ np.where(has, values, 0.0)) / (draws @ has.astype(np.float64))


def bounds(resampled: Array, counts: NDArray[np.intp]) -> tuple[Array, Array]:
    """Bounds (K,) of the 95 % interval of resampled values (B, K); NaN where less than two counted."""
    low, high = np.full((2, resampled.shape[1]), np.nan)
    enough = counts >= 2
    if enough.any():
        tail = 50.0 * (1.0 - LEVEL)
        low[enough], high[enough] = np.nanpercentile(resampled[:, enough], [tail, 100.0 - tail], axis=0)
    return low, high


def interval(values: Array, operators: Sequence[str], seed: int) -> Interval:
    """The mean over operators of values (T,) of their trials, NaN for none."""
    means = by_operator(values[:, None], operators).means if len(values) else np.empty((0, 1))
    count = int(np.isfinite(means).sum())
    if count == 0:
        return Interval(np.nan, np.nan, np.nan, 0)
    low, high = bounds(resampled_means(means, seed), np.array([count]))
    return Interval(float(np.nanmean(means)), float(low[0]), float(high[0]), count)
