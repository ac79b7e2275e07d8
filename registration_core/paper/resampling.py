"""Weights of particles as logarithms, and drawing particles by weight."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def normalised(log_weights: Array) -> Array:
    """Weights (N,) that sum to 1, from log-weights (N,) up to a common constant.

    -inf is a weight of zero. If *all* are -inf, no particle has any support: the evidence cannot tell them
    apart, so they weigh the same.

    Raises:
        ValueError: where a log-weight is NaN or +inf, or there is none.
    """
    if log_weights.size == 0:
        raise ValueError("log_weights must have at least one entry")
    highest = log_weights.max()
    if np.isnan(highest) or highest == np.inf:
        raise ValueError("log_weights must not hold NaN or +inf")
    if highest == -np.inf:
        return np.full(log_weights.shape, 1.0 / log_weights.size)
    weights = np.exp(log_weights - highest)
    return weights / weights.sum()


def systematic(weights: Array, rng: np.random.Generator, count: int | None = None) -> NDArray[np.intp]:
    """Indices (count,) drawn by systematic resampling: each particle floor or ceil of count * weight times.

    Args:
        weights: (N,), normalised.
        count: how many to draw, N where it is None.
    """
    count = len(weights) if count is None else count
    cumulative = np.cumsum(weights)
    cumulative[-1] = np.inf  # rounding may leave the sum below 1, and a draw above it
    return np.searchsorted(cumulative, (np.arange(count) + rng.random()) / count, side="right")
