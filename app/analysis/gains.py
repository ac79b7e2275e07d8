"""Whether a snap improves a pose: its error before and after, over operators."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.analysis.bootstrap import Interval, interval
from app.analysis.remarks import counted
from app.analysis.trial import ERROR_KINDS, ErrorKind, TrialTrace
from app.analysis.units import interval_told, told

MOMENTS = ("at the end", "all along")
"""From the final pose; from all sampled poses, each trial counting with its mean."""


@dataclass(frozen=True)
class Gain:
    """Errors before and after a snap; metres or radians."""

    group: str
    mode: str
    condition: str
    error: ErrorKind
    moment: str
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
        before, after = told(self.before.mean, self.error), told(self.after.mean, self.error)
        return (
            f"{self.group}, {self.mode}, {self.condition}, {self.moment}: {self.verdict}; {self.error} error"
            f" {before} before and {after} after, gain {interval_told(self.gain, self.error)} over"
            f" {counted(self.gain.operators, 'operator')}."
        )


def gains(trials: Sequence[TrialTrace], seed: int) -> list[Gain]:
    """Of trials of one group, mode and condition: for both errors, at the end and all along."""
    with_stg = [trial for trial in trials if trial.has_stg]
    return [_gain(with_stg, kind, moment, seed) for kind in ERROR_KINDS for moment in MOMENTS if with_stg]


def _gain(trials: Sequence[TrialTrace], kind: ErrorKind, moment: str, seed: int) -> Gain:
    pairs = [(trial.of_kind(kind), trial.stg_of_kind(kind)) for trial in trials]
    if moment == "at the end":
        pairs = [(before[-1:], after[-1:]) for before, after in pairs]
    known = [(before[np.isfinite(after)], after[np.isfinite(after)]) for before, after in pairs]
    means = np.array([[b.mean(), a.mean(), (b - a).mean()] if len(a) else [np.nan] * 3 for b, a in known])
    better = np.concatenate([after < before for before, after in known])
    operators = [trial.operator for trial in trials]
    before, after, gain = (interval(column, operators, seed) for column in means.T)
    first = trials[0]
    return Gain(
        group=first.group,
        mode=first.mode,
        condition=first.condition,
        error=kind,
        moment=moment,
        before=before,
        after=after,
        gain=gain,
        improved=float(better.mean()) if len(better) else np.nan,
        trials=sum(len(after) > 0 for _, after in known),
    )
