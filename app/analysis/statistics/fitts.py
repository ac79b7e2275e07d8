"""Fitts' law over error margins: time = a + b log2(D / W + 1).

Fitts (1954) in the form of MacKenzie (1992). The distance D is fixed, the margin is the target's width W.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.analysis.statistics.bootstrap import LEVEL, resampled_means
from app.analysis.statistics.curves import Curve

Array = NDArray[np.float64]

LEAST_MARGINS = 3
"""A line through two points says nothing of how well it fits."""
ROUNDING = 1e-9
"""Seconds: means of equal times differ by less, and no line goes through that."""


@dataclass(frozen=True)
class Fitts:
    """A regression over the margins of one curve; each interval is over operators."""

    distance: float
    """D, metres or radians."""
    margins: int
    """Points of the line."""
    bits: tuple[float, float]
    """The least and the greatest index of difficulty."""
    operators: int
    trials: int
    """At the margin that fewest come within."""
    a: float
    """Seconds."""
    a_interval: tuple[float, float]
    b: float
    """Seconds a bit."""
    b_interval: tuple[float, float]
    r_squared: float
    throughput: float
    """1 / b, bits a second; NaN where b is not positive."""

    @property
    def throughput_interval(self) -> tuple[float, float]:
        """Of the interval of b; NaN where b may be 0 or less."""
        low, high = self.b_interval
        return (1.0 / high, 1.0 / low) if low > 0 else (np.nan, np.nan)


def fitts(curve: Curve, distance: float, seed: int) -> Fitts | None:
    """Fit the curve's means where W < D and at least half of the operators come within W, so that the line
    does not follow those who are left.

    Returns:
        None where these are less than three margins.
    """
    used = (curve.margins < distance) & (2 * curve.operators >= len(curve.values)) & (curve.operators > 0)
    if used.sum() < LEAST_MARGINS:
        return None
    bits = np.log2(distance / curve.margins[used] + 1.0)
    (a,), (b,), (r_squared,) = _lines(bits, curve.mean[None, used])
    resampled = resampled_means(curve.values, seed)[:, used]
    some_a, some_b, _ = _lines(bits, resampled[np.isfinite(resampled).all(axis=1)])
    enough = len(curve.values) >= 2
    return Fitts(
        distance=distance,
        margins=int(used.sum()),
        bits=(float(bits.min()), float(bits.max())),
        operators=int(curve.operators[used].min()),
        trials=int(curve.trials[used].min()),
        a=float(a),
        a_interval=_interval(some_a) if enough else (np.nan, np.nan),
        b=float(b),
        b_interval=_interval(some_b) if enough else (np.nan, np.nan),
        r_squared=float(r_squared),
        throughput=float(1.0 / b) if b > 0 else np.nan,
    )


def _lines(bits: Array, seconds: Array) -> tuple[Array, Array, Array]:
    """Least squares of seconds (B, K) over bits (K,): intercepts, slopes and R^2, (B,) each."""
    x = bits - bits.mean()
    y = seconds - seconds.mean(axis=1, keepdims=True)
    y = np.where(np.abs(y) < ROUNDING, 0.0, y)
    slope = y @ x / (x @ x)
    total = (y**2).sum(axis=1)
    left = ((y - slope[:, None] * x) ** 2).sum(axis=1)
    with np.errstate(invalid="ignore"):
        r_squared = 1.0 - left / np.where(total > 0, total, np.nan)
    return seconds.mean(axis=1) - slope * bits.mean(), slope, r_squared


def _interval(values: Array) -> tuple[float, float]:
    tail = 50.0 * (1.0 - LEVEL)
    low, high = np.percentile(values, [tail, 100.0 - tail])
    return float(low), float(high)
