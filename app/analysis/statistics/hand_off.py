"""At which error an operator should let the machine take over: where the STG curve leaves the human one."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.analysis.statistics.bootstrap import bounds, by_operator, resampled_means

Array = NDArray[np.float64]


@dataclass(frozen=True)
class HandOff:
    """From this error on, towards smaller ones, a snap saves time."""

    margin: float
    """Metres or radians."""
    is_largest: bool
    """Whether it is the largest of all margins: the curves may part farther out."""
    is_smallest: bool
    """Whether it is the only one that counts: at no smaller margin there are enough operators to compare."""
    best_margin: float
    """Where it saves most for sure."""
    saved: float
    """Seconds there, mean over the operators who come within it both ways."""
    saved_interval: tuple[float, float]
    operators: int


def hand_off(human: Array, stg: Array, operators: Sequence[str], margins: Array, seed: int) -> HandOff | None:
    """Compare times (T, K) of the same trials by hand and by snap, trial by trial.

    A snap saves time for sure where the 95 % interval of the saved seconds lies above 0 and at least half of
    the operators come there both ways: the few who reach small margins are not all. From the margin
    where it saves most for sure, go to larger ones for as long as it does: at the last one the curves part.

    Returns:
        None where a snap saves time for sure at no margin.
    """
    saved = by_operator(human - stg, operators).means
    known = np.isfinite(saved)
    count = known.sum(axis=0)
    low, high = bounds(resampled_means(saved, seed), count)
    with np.errstate(invalid="ignore"):
        mean = np.where(known, saved, 0.0).sum(axis=0) / count
    enough = 2 * count >= len(saved)
    ahead = (np.nan_to_num(low, nan=-1.0) > 0.0) & enough
    if not ahead.any():
        return None
    best = int(np.where(ahead, mean, -np.inf).argmax())
    behind = np.flatnonzero(~ahead[:best])
    first = int(behind[-1]) + 1 if len(behind) else 0
    return HandOff(
        margin=float(margins[first]),
        is_largest=first == 0,
        is_smallest=not enough[first + 1 :].any(),
        best_margin=float(margins[best]),
        saved=float(mean[best]),
        saved_interval=(float(low[best]), float(high[best])),
        operators=int(count[best]),
    )
