"""Curves of a human-in-the-loop registration: seconds needed to come within each error margin."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.analysis.statistics.bootstrap import bounds, by_operator, resampled_means
from app.analysis.study_data.trial import ErrorKind, TrialTrace
from app.storage.tables import Method

Array = NDArray[np.float64]

MARGINS: Mapping[ErrorKind, Array] = {
    "translation": np.geomspace(0.1, 0.001, 41),
    "rotation": np.radians(np.geomspace(90.0, 0.9, 41)),
}
"""(K,), from large to small, metres and radians: twenty to each power of ten."""
SNAP_SECONDS = 0.1
PAPER_SECONDS = 7.0
"""What each snap is charged with, unless the report says otherwise: a filter takes 5 to 10 s on two cores."""


@dataclass(frozen=True)
class Timing:
    """How the time of a report is counted."""

    snap_seconds: float = SNAP_SECONDS
    """A fixed charge, so that a report does not hang on how busy a machine was."""
    without_idle: bool = False
    paper_seconds: float = PAPER_SECONDS
    """The same for one by the paper's filter."""

    def charged(self, method: Method) -> float:
        """Seconds for a snap by a method."""
        return self.paper_seconds if method == "paper" else self.snap_seconds

    def of(self, trial: TrialTrace) -> Array:
        """Seconds (M,) of a trial's samples."""
        return trial.active_seconds if self.without_idle else trial.seconds


@dataclass(frozen=True, eq=False)
class Curve:
    """Seconds to come within each of K margins, over operators."""

    margins: Array
    """(K,), from large to small, metres or radians."""
    mean: Array
    """(K,), seconds, over the operators who come within it; NaN where nobody does."""
    low: Array
    high: Array
    """(K,), bounds of the 95 % interval of the mean; NaN for less than two operators."""
    operators: NDArray[np.intp]
    """(K,), who come within it in at least one trial."""
    trials: NDArray[np.intp]
    """(K,), trials that come within it."""
    share: Array
    """(K,), of the trials that come within it, averaged over all operators: those who remain."""
    typical: NDArray[np.intp]
    """(K,), the trial whose time is nearest to the mean; -1 where nobody comes within it."""
    values: Array
    """(O, K), each operator's mean over trials that come within it, NaN for none."""


def first_within(seconds: Array, errors: Array, margins: Array) -> Array:
    """(K,): when errors (M,) at times (M,) first are within margins (K,); NaN where they never are.

    A NaN among the errors is within no margin.
    """
    least = np.minimum.accumulate(np.where(np.isnan(errors), np.inf, errors))
    first = np.searchsorted(-least, -margins, side="left")
    return np.append(seconds, np.nan)[first]


def human_times(trials: Sequence[TrialTrace], kind: ErrorKind, timing: Timing) -> Array:
    """(T, K), the baseline: when each trial's pose first comes within each margin."""
    margins = MARGINS[kind]
    rows = [first_within(timing.of(trial), trial.of_kind(kind), margins) for trial in trials]
    return np.array(rows).reshape(-1, len(margins))


def stg_times(
    trials: Sequence[TrialTrace], kind: ErrorKind, timing: Timing, method: Method = "default"
) -> Array:
    """(T, K): when a snap by this method, asked for at each sample, brings a trial within each margin."""
    margins = MARGINS[kind]
    rows = [
        first_within(timing.of(trial) + timing.charged(method), trial.stg_of_kind(kind, method), margins)
        for trial in trials
    ]
    return np.array(rows).reshape(-1, len(margins))


def curve_of(times: Array, operators: Sequence[str], margins: Array, seed: int) -> Curve:
    """The mean over operators of times (T, K), T >= 1; each operator (T,) counts once."""
    grouped = by_operator(times, operators)
    reached = np.isfinite(grouped.means)
    count = reached.sum(axis=0)
    with np.errstate(invalid="ignore"):
        mean = np.where(reached, grouped.means, 0.0).sum(axis=0) / count
    low, high = bounds(resampled_means(grouped.means, seed), count)
    off = np.where(np.isfinite(times), np.abs(times - mean), np.inf)
    return Curve(
        margins=margins,
        mean=mean,
        low=low,
        high=high,
        operators=count,
        trials=grouped.trials.sum(axis=0),
        share=grouped.shares.mean(axis=0),
        typical=np.where(count > 0, off.argmin(axis=0), -1),
        values=grouped.means,
    )
