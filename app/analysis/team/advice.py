"""When an operator should let the machine take over, told from their own snaps."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.analysis.statistics.curves import first_within
from app.analysis.statistics.units import told
from app.analysis.study_data.remarks import counted
from app.analysis.team.team import Work

Array = NDArray[np.float64]

LEAST_SNAPS = 10
LANDED = (0.005, np.radians(5.0))
"""Metres and radians from the last pose within which a snap's result counts as having landed there."""
LANDING_SHARE = 0.9
"""Of the snaps from within the advised error; as sure as the machine is when it takes over by itself."""


@dataclass(frozen=True)
class Advice:
    """What an operator is told."""

    operator: str
    snaps: int
    translation: float
    """Metres at which to let the machine take over; NaN where no error can be advised."""
    rotation: float
    """Radians, the same."""
    dragged_on: float
    """Seconds from there to the first snap's result, mean of the registrations with a snap."""
    text: str


def advice_for(operator: str, work: Sequence[Work]) -> Advice:
    """The largest errors, of translation and of rotation, from within which 90 % of the snaps of this
    operator's registrations landed where the object was left.
    """
    starts, results = (
        np.concatenate([np.stack(errors, axis=1) for errors in kind])
        for kind in ([one.starts for one in work], [one.results for one in work])
    )
    snaps = len(starts)
    if snaps < LEAST_SNAPS:
        few = f"Too few snaps for an advice: {snaps} of at least {LEAST_SNAPS}."
        return Advice(operator, snaps, np.nan, np.nan, np.nan, few)
    landed = np.all(results <= LANDED, axis=1)
    translation, rotation = (_largest_start(column, landed) for column in starts.T)
    if not np.isfinite([translation, rotation]).all():
        share = f"{int(landed.sum())} of {counted(snaps, 'snap')}"
        rather = f"No error can be advised: only {share} landed where the object was left."
        return Advice(operator, snaps, translation, rotation, np.nan, rather)
    dragged_on = _dragged_on(work, translation, rotation)
    near = np.all(starts <= (translation, rotation), axis=1)
    text = (
        f"Let the machine take over from {told(translation, 'translation')} and {told(rotation, 'rotation')}"
        f" on: {int(landed[near].sum())} of {counted(int(near.sum()), 'snap')} from within landed where the"
        f" object was left. The first one came {dragged_on:.1f} s later than that."
    )
    return Advice(operator, snaps, translation, rotation, dragged_on, text)


def _largest_start(starts: Array, landed: NDArray[np.bool_]) -> float:
    """The largest of the errors (N,) from within which enough landed; NaN where there is none."""
    order = np.argsort(starts, kind="stable")
    shares = np.cumsum(landed[order]) / np.arange(1, len(order) + 1)
    enough = np.flatnonzero(shares >= LANDING_SHARE)
    return float(starts[order[enough[-1]]]) if len(enough) else np.nan


def _dragged_on(work: Sequence[Work], translation: float, rotation: float) -> float:
    waits = []
    for one in work:
        trial = one.trial
        is_near = (trial.errors.translation <= translation) & (trial.errors.rotation <= rotation)
        came, reached = (
            float(first_within(trial.active_seconds, np.where(is_so, 0.0, np.nan), np.zeros(1))[0])
            for is_so in (np.isfinite(trial.stg_of_kind("translation")), is_near)
        )
        if np.isfinite(came):
            waits.append(max(0.0, came - reached))
    return float(np.mean(waits))
