"""The offline snaps of a study, put beside the samples that they began from."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Text, cast, select
from sqlalchemy.orm import Session

from app.analysis.study_data.remarks import Remark
from app.analysis.study_data.trial import METHODS, TrialTrace
from app.analysis.trace.logs import decoded_pose
from app.storage.tables import Method, OfflineSnap, Participant, Registration
from registration_core import ALGORITHM

Array = NDArray[np.float64]

TICKS = 1e6
"""Of a second, to which the time of a sample and that of its snap agree."""
ABOUT = "offline snaps"
COMMANDS: Mapping[Method, str] = {
    "default": "`snap6d study snap`",
    "paper": "`snap6d study snap --method paper`",
}


SnapsBySecond = Mapping[int, Sequence[Sequence[float]] | None]
"""T_world_object (4, 4) of the snaps of a registration, by the second of the trace, in ticks; None where one
failed."""


@dataclass(frozen=True)
class StudySnaps:
    """The offline snaps of a study by one method, all of one algorithm: numbers of two are never mixed."""

    by_registration: Mapping[int, SnapsBySecond]
    algorithm: str | None
    """That computed them; None where an older version did not say."""


class SnapsAt(NamedTuple):
    """The snaps from M samples."""

    places: list[int]
    """(N,), the samples whose snap has a result."""
    T_world_object: Array
    """(N, 4, 4), these results."""
    computed: NDArray[np.bool_]
    """(M,), from which samples a snap was computed, though it failed."""


def snaps_of(session: Session, study_id: int) -> dict[Method, StudySnaps]:
    """The offline snaps of a study by method: of several from one pose the newest counts.

    Where they are of several algorithms, those of the one that has most of them count, of the newest among
    equals: so a report goes on as it was until a batch with a new algorithm is done.
    """
    query = (
        select(
            OfflineSnap.method,
            OfflineSnap.algorithm,
            OfflineSnap.registration_id,
            OfflineSnap.seconds,
            cast(OfflineSnap.T_world_object, Text),
        )
        .join(Registration, OfflineSnap.registration_id == Registration.id)
        .join(Participant, Participant.user_id == Registration.user_id)
        .where(Participant.study_id == study_id)
        .order_by(OfflineSnap.id)
    )
    rows: dict[str, list[Sequence[Any]]] = defaultdict(list)
    for method, *row in session.execute(query):
        rows[method].append(row)
    return {method: _of_one_algorithm(rows[method]) for method in METHODS if method in rows}


def _of_one_algorithm(rows: Sequence[Sequence[Any]]) -> StudySnaps:
    """Of rows of algorithm, registration, second and result, in the order in which they were computed."""
    snaps: dict[str | None, dict[int, dict[int, Any]]] = defaultdict(lambda: defaultdict(dict))
    newest: dict[str | None, int] = {}
    for place, (algorithm, registration_id, seconds, text) in enumerate(rows):
        snaps[algorithm][registration_id][round(TICKS * seconds)] = decoded_pose(text)
        newest[algorithm] = place
    shown = max(newest, key=lambda one: (sum(map(len, snaps[one].values())), newest[one]))
    return StudySnaps(snaps[shown], shown)


def snaps_at(times: Array, snaps: SnapsBySecond) -> SnapsAt:
    """The snaps of a registration from its samples at times (M,) of the trace."""
    ticks = np.rint(TICKS * times).astype(np.int64).tolist()
    found = [(i, T) for i, tick in enumerate(ticks) if (T := snaps.get(tick)) is not None]
    T_world_object = np.array([T for _, T in found]).reshape(-1, 4, 4)
    return SnapsAt([i for i, _ in found], T_world_object, np.array([tick in snaps for tick in ticks]))


def about_snaps(trials: Sequence[TrialTrace], snaps: Mapping[Method, StudySnaps]) -> Iterator[Remark]:
    """What is to be said of the snaps of the trials that count."""
    if not any(trial.stg for trial in trials):
        yield Remark(
            ABOUT, f"none were computed; there are no STG curves until {COMMANDS['default']} computes them"
        )
        return
    for method in METHODS:
        if any(method in trial.stg for trial in trials):
            yield from _about_method(trials, method, snaps[method].algorithm)


def _about_method(trials: Sequence[TrialTrace], method: Method, algorithm: str | None) -> Iterator[Remark]:
    about = ABOUT if method == "default" else f"{ABOUT} by the paper's filter"
    command = COMMANDS[method]
    samples = sum(len(trial.seconds) for trial in trials)
    missing = sum(trial.missing_snaps(method) for trial in trials)
    computed = samples - missing
    if method == "paper":
        text = (
            f"{computed} of {samples} sampled poses have one, chosen as time and movement go on: STG"
            f" curves come late by up to what lies between two; gains from the same poses compare methods"
        )
        yield Remark(about, text)
        missing = sum(method not in trial.stg or not trial.stg[method].computed[-1] for trial in trials)
        samples = len(trials)
    if missing:
        what = "sampled poses have none yet" if method == "default" else "trials have none at their end yet"
        text = (
            f"{missing} of {samples} {what}, so that STG curves come too late and too low; {command} computes"
            f" them"
        )
        yield Remark(about, text)
    failed = computed - sum(
        int(np.isfinite(trial.stg_of_kind("translation", method)).sum()) for trial in trials
    )
    if failed:
        yield Remark(about, f"{failed} of {computed} failed; they come within no margin")
    if algorithm != ALGORITHM:
        theirs = f"algorithm {algorithm}" if algorithm else "a version that did not name its algorithm"
        text = (
            f"they are of {theirs}, while this version has algorithm {ALGORITHM}; {command}"
            f" computes them anew, and this report takes those once it has as many"
        )
        yield Remark(about, text)
