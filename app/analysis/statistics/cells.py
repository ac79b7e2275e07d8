"""The curves of each group, mode, condition and error, with all that is read off them."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from app.analysis.statistics.curves import MARGINS, Curve, Timing, curve_of, human_times, stg_times
from app.analysis.statistics.fitts import Fitts, fitts
from app.analysis.statistics.hand_off import HandOff, hand_off
from app.analysis.study_data.trial import ERROR_KINDS, METHODS, ErrorKind, TrialTrace
from app.storage.tables import Method

Array = NDArray[np.float64]
Unit = Callable[[TrialTrace], str]
"""What counts once in means and intervals: an operator; a registration where there is one operator only."""


@dataclass(frozen=True, eq=False)
class Drawn:
    """A curve and where it comes from."""

    curve: Curve
    registration_ids: tuple[int | None, ...]
    """(K,), whose time is nearest to the mean; None where nobody comes within the margin."""
    fitts: Fitts | None


@dataclass(frozen=True, eq=False)
class StgCurve(Drawn):
    """The curve of snaps by one method."""

    hand_off: HandOff | None


@dataclass(frozen=True, eq=False)
class Cell:
    """What operators of one group did in one mode under one condition, judged by one error."""

    group: str
    mode: str
    condition: str
    error: ErrorKind
    operators: int
    trials: int
    human: Drawn
    """As it was done; by hand alone where the condition is manual."""
    stg: Mapping[Method, StgCurve]
    """By the methods by which any snap was computed."""

    @property
    def curves(self) -> Iterator[tuple[Method | None, Drawn]]:
        """The human's, which has no method, and then those of the snaps."""
        yield None, self.human
        yield from self.stg.items()


CURVE_NAMES: Mapping[Method | None, str] = {None: "human", "default": "STG", "paper": "STG, paper's filter"}
"""As people read them."""


def operator_of(trial: TrialTrace) -> str:
    """Operators count once each."""
    return trial.operator


def cells_of(trials: Sequence[TrialTrace], timing: Timing, seed: int, unit: Unit = operator_of) -> list[Cell]:
    """The cells that have trials, in the order of groups, modes and conditions as they first come."""
    keys = dict.fromkeys((trial.group, trial.mode, trial.condition) for trial in trials)
    distances = {kind: _distance(trials, kind) for kind in ERROR_KINDS}
    return [
        _cell([trial for trial in trials if key_of(trial) == key], kind, distances[kind], timing, seed, unit)
        for key, kind in product(keys, ERROR_KINDS)
    ]


def key_of(trial: TrialTrace) -> tuple[str, str, str]:
    """Group, mode and condition."""
    return trial.group, trial.mode, trial.condition


def _cell(
    trials: Sequence[TrialTrace], kind: ErrorKind, distance: float, timing: Timing, seed: int, unit: Unit
) -> Cell:
    units = [unit(trial) for trial in trials]
    human = human_times(trials, kind, timing)
    stg = {
        method: stg_times(trials, kind, timing, method)
        for method in METHODS
        if any(trial.has_stg(method) for trial in trials)
    }
    group, mode, condition = key_of(trials[0])
    return Cell(
        group=group,
        mode=mode,
        condition=condition,
        error=kind,
        operators=len({trial.operator for trial in trials}),
        trials=len(trials),
        human=Drawn(*_drawn(human, trials, units, kind, distance, seed)),
        stg={
            method: StgCurve(
                *_drawn(times, trials, units, kind, distance, seed),
                hand_off=hand_off(human, times, units, MARGINS[kind], seed),
            )
            for method, times in stg.items()
        },
    )


def _drawn(
    times: Array,
    trials: Sequence[TrialTrace],
    units: Sequence[str],
    kind: ErrorKind,
    distance: float,
    seed: int,
) -> tuple[Curve, tuple[int | None, ...], Fitts | None]:
    curve = curve_of(times, units, MARGINS[kind], seed)
    ids = tuple(None if i < 0 else trials[i].registration_id for i in curve.typical.tolist())
    return curve, ids, fitts(curve, distance, seed)


def _distance(trials: Sequence[TrialTrace], kind: ErrorKind) -> float:
    """The fixed distance of Fitts' law: the median error at first sight, over all trials."""
    return float(np.median([trial.of_kind(kind)[0] for trial in trials])) if trials else np.nan
