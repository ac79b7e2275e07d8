"""Whether a snap improves a pose: its error before and after, over operators."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from app.analysis.statistics.bootstrap import Interval, interval
from app.analysis.statistics.units import interval_told, told
from app.analysis.study_data.remarks import counted
from app.analysis.study_data.trial import ERROR_KINDS, METHODS, ErrorKind, TrialTrace
from app.storage.tables import Method

Moment = Literal["at the end", "all along", "from the same poses"]
"""From the final pose; from all sampled poses, each trial counting with its mean; the same, from those poses
alone from which every method has a result, where there are several methods."""


@dataclass(frozen=True)
class Gain:
    """Errors before and after a snap; metres or radians."""

    group: str
    mode: str
    condition: str
    method: Method
    error: ErrorKind
    moment: Moment
    before: Interval
    after: Interval
    gain: Interval
    """Before - after, trial by trial: above 0 where the snap improves the pose."""
    improved: float
    """Share of the poses that are better afterwards."""
    trials: int

    @property
    def verdict(self) -> str:
        """What the interval of the gain allows to say."""
        if self.gain.operators == 0:
            return "no snap was computed from there"
        if self.gain.operators < 2:
            return "cannot be told: less than two operators"
        if self.gain.low > 0:
            return "a snap improves it"
        return "a snap worsens it" if self.gain.high < 0 else "no difference can be shown"

    @property
    def sentence(self) -> str:
        """The verdict with its numbers."""
        by = ", by the paper's filter" if self.method == "paper" else ""
        before, after = told(self.before.mean, self.error), told(self.after.mean, self.error)
        gain, operators = interval_told(self.gain, self.error), counted(self.gain.operators, "operator")
        return (
            f"{self.group}, {self.mode}, {self.condition}, {self.moment}{by}: {self.verdict};"
            f" {self.error} error {before} before and {after} after, gain {gain} over {operators}."
        )


def gains(trials: Sequence[TrialTrace], seed: int) -> list[Gain]:
    """Of trials of one group, mode and condition: by each method, for both errors, at each moment."""
    methods = [method for method in METHODS if any(trial.has_stg(method) for trial in trials)]
    moments: list[Moment] = ["at the end", "all along"]
    moments += ["from the same poses"] if len(methods) > 1 else []
    return [
        _gain([trial for trial in trials if trial.has_stg(method)], kind, method, moment, methods, seed)
        for kind in ERROR_KINDS
        for moment in moments
        for method in methods
    ]


def _gain(
    trials: Sequence[TrialTrace],
    kind: ErrorKind,
    method: Method,
    moment: Moment,
    methods: Sequence[Method],
    seed: int,
) -> Gain:
    known = []
    for trial in trials:
        snapped = trial.stg_of_kind(kind, method)
        counts = np.isfinite(snapped)
        if moment == "at the end":
            counts[:-1] = False
        elif moment == "from the same poses":
            counts &= np.isfinite([trial.stg_of_kind(kind, other) for other in methods]).all(axis=0)
        known.append((trial.of_kind(kind)[counts], snapped[counts]))
    means = np.array([[b.mean(), a.mean(), (b - a).mean()] if len(a) else [np.nan] * 3 for b, a in known])
    better = np.concatenate([after < before for before, after in known])
    operators = [trial.operator for trial in trials]
    before, after, gain = (interval(column, operators, seed) for column in means.T)
    first = trials[0]
    return Gain(
        group=first.group,
        mode=first.mode,
        condition=first.condition,
        method=method,
        error=kind,
        moment=moment,
        before=before,
        after=after,
        gain=gain,
        improved=float(better.mean()) if len(better) else np.nan,
        trials=sum(len(after) > 0 for _, after in known),
    )
