"""Conditions and techniques compared in pairs: what the same operator did with the same task under both."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from app.analysis.statistics.bootstrap import Interval, interval
from app.analysis.statistics.curves import Timing
from app.analysis.study_data.trial import TrialTrace

Key = tuple[str, str, str, str, int]


EVERYBODY = "all groups"


@dataclass(frozen=True)
class Comparison:
    """Differences `second` - `first` over pairs of trials; below 0 the second one is better."""

    group: str
    """Or `EVERYBODY`."""
    mode: str
    first: str
    second: str
    """Conditions."""
    pairs: int
    seconds: Interval
    """Of the whole registration."""
    translation: Interval
    """Metres, of the final pose."""
    rotation: Interval
    """Radians, of the final pose."""


def comparisons(trials: Sequence[TrialTrace], timing: Timing, seed: int) -> list[Comparison]:
    """All conditions against each other, mode by mode, where anybody did the same under both: of each group,
    and where there are several, of everybody.
    """
    groups = list(dict.fromkeys(trial.group for trial in trials))
    parts = {name: [trial for trial in trials if trial.group == name] for name in groups}
    if len(groups) > 1:
        parts[EVERYBODY] = list(trials)
    return [one for name, part in parts.items() for one in _of_group(name, part, timing, seed)]


def _of_group(group: str, trials: Sequence[TrialTrace], timing: Timing, seed: int) -> list[Comparison]:
    found = []
    for mode in sorted({trial.mode for trial in trials}):
        of_mode = [trial for trial in trials if trial.mode == mode]
        conditions = sorted({trial.condition for trial in of_mode}, key=lambda name: (name != "manual", name))
        for first, second in combinations(conditions, 2):
            comparison = _compare(of_mode, group, mode, first, second, timing, seed)
            if comparison.pairs:
                found.append(comparison)
    return found


def _compare(
    trials: Sequence[TrialTrace],
    group: str,
    mode: str,
    first: str,
    second: str,
    timing: Timing,
    seed: int,
) -> Comparison:
    before = {_key(trial): trial for trial in trials if trial.condition == first}
    pairs = [
        (before[_key(trial)], trial)
        for trial in trials
        if trial.condition == second and _key(trial) in before
    ]
    operators = [trial.operator for _, trial in pairs]
    rows = np.array([_outcome(b, timing) - _outcome(a, timing) for a, b in pairs]).reshape(-1, 3)
    seconds, translation, rotation = (interval(column, operators, seed) for column in rows.T)
    return Comparison(group, mode, first, second, len(pairs), seconds, translation, rotation)


def _key(trial: TrialTrace) -> Key:
    return trial.operator, trial.mode, trial.scene, trial.object, trial.instance


def _outcome(trial: TrialTrace, timing: Timing) -> np.ndarray:
    return np.array(
        [timing.of(trial)[-1], trial.errors.translation[-1], trial.errors.rotation[-1]], dtype=np.float64
    )
