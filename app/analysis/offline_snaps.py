"""The offline snaps of a study, put beside the samples that they began from."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Text, cast, select
from sqlalchemy.orm import Session

from app.analysis.logs import decoded_pose
from app.analysis.remarks import Remark
from app.analysis.trial import TrialTrace
from app.tables import OfflineSnap, Participant, Registration

Array = NDArray[np.float64]

TICKS = 1e6
"""Of a second, to which the time of a sample and that of its snap agree."""
ABOUT = "offline snaps"


class StoredSnap(NamedTuple):
    """What one snap came to."""

    T_world_object: Sequence[Sequence[float]] | None
    """(4, 4); None where it failed."""
    version: str
    """Of Snap6D, that computed it."""


SnapsBySecond = dict[int, StoredSnap]
"""Of a registration, by the second of the trace, in ticks."""


class SnapsAt(NamedTuple):
    """The snaps from M samples."""

    places: list[int]
    """(N,), the samples whose snap has a result."""
    T_world_object: Array
    """(N, 4, 4), these results."""
    missing: int
    """Samples from which no snap was computed, which is another thing than one that failed."""


def snaps_of(session: Session, study_id: int) -> dict[int, SnapsBySecond]:
    """The offline snaps of a study by registration; of several from one pose the newest counts."""
    query = (
        select(
            OfflineSnap.registration_id,
            OfflineSnap.seconds,
            cast(OfflineSnap.T_world_object, Text),
            OfflineSnap.version,
        )
        .join(Registration, OfflineSnap.registration_id == Registration.id)
        .join(Participant, Participant.user_id == Registration.user_id)
        .where(Participant.study_id == study_id)
        .order_by(OfflineSnap.id)
    )
    snaps: dict[int, SnapsBySecond] = defaultdict(dict)
    for registration_id, seconds, text, version in session.execute(query):
        snaps[registration_id][round(TICKS * seconds)] = StoredSnap(decoded_pose(text), version)
    return snaps


def snaps_at(times: Array, snaps: SnapsBySecond) -> SnapsAt:
    """The snaps of a registration from its samples at times (M,) of the trace."""
    stored = [snaps.get(tick) for tick in np.rint(TICKS * times).astype(np.int64).tolist()]
    found = [(i, T) for i, one in enumerate(stored) if one is not None and (T := one[0]) is not None]
    T_world_object = np.array([T for _, T in found]).reshape(-1, 4, 4)
    return SnapsAt([i for i, _ in found], T_world_object, stored.count(None))


def about_snaps(trials: Sequence[TrialTrace], snaps: Mapping[int, SnapsBySecond]) -> Iterator[Remark]:
    """What is to be said of the snaps of the trials that count."""
    samples = sum(len(trial.seconds) for trial in trials)
    missing = sum(trial.missing_snaps for trial in trials)
    if missing == samples:
        yield Remark(ABOUT, "none were computed; there are no STG curves")
        return
    if missing:
        text = (
            f"{missing} of {samples} sampled poses have none yet, so that STG curves come too late and too"
            f" low; `snap6d study snap` computes them"
        )
        yield Remark(ABOUT, text)
    computed = samples - missing
    failed = computed - sum(int(np.isfinite(trial.stg_errors.translation).sum()) for trial in trials)
    if failed:
        yield Remark(ABOUT, f"{failed} of {computed} failed; they come within no margin")
    of_trials = [snaps.get(trial.registration_id, {}) for trial in trials]
    versions = sorted({snap.version for by_second in of_trials for snap in by_second.values()})
    if len(versions) > 1:
        text = f"they are of several versions of Snap6D, {', '.join(versions)}, and are shown as one"
        yield Remark(ABOUT, text)
