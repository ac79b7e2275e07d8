"""Whether what clients finished is in the database, each once."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select

from app.storage.database import Database
from app.storage.tables import EstimateRow, Event

Array = NDArray[np.float64]

TOLERANCE = 1e-9
"""Between a pose that was sent or shown and the same one in the database; metres, or a rotation's entries."""
RESULTS = frozenset({"snap_applied", "snap_offered"})
ROWS_BESIDE_UPDATES = 2
"""Of a drag's path: where it was taken and where it was let go."""


@dataclass
class Finished:
    """What one client finished, as it saw it."""

    registration_id: int
    drags: list[Array] = field(default_factory=list)
    """T_world_object (4, 4) at the end of each drag; no two are alike."""
    updates_a_drag: int = 0
    snaps: dict[str, Array | None] = field(default_factory=dict)
    """T_world_object (4, 4) of each snap's result by the snap's id; None where the client did not see it."""


@dataclass(frozen=True)
class Balance:
    """How what is in the database differs from what was finished; all zero where nothing is wrong."""

    lost: int = 0
    """Finished and not there, or there with another pose."""
    surplus: int = 0
    """There twice, or never finished."""

    def __add__(self, other: "Balance") -> "Balance":
        return Balance(self.lost + other.lost, self.surplus + other.surplus)


@dataclass(frozen=True)
class Comparison:
    """Finished work against the database."""

    drags: Balance
    path_rows: Balance
    snaps: Balance


def compare_all(database: Database, finished: Sequence[Finished]) -> Comparison:
    """Compare what all clients finished with their registrations' rows."""
    parts = [_compare(database, work) for work in finished]
    return Comparison(
        drags=sum((part.drags for part in parts), Balance()),
        path_rows=sum((part.path_rows for part in parts), Balance()),
        snaps=sum((part.snaps for part in parts), Balance()),
    )


def compare_drags(finished: Sequence[Array], logged: Sequence[Array]) -> Balance:
    """Poses (4, 4) at the ends of drags, in their order, against those in the log."""
    kept = matches = 0
    for T in logged:
        later = [n for n in range(kept, len(finished)) if is_same(T, finished[n])]
        if later:
            kept = later[0] + 1
            matches += 1
    return Balance(lost=len(finished) - matches, surplus=len(logged) - matches)


def compare_snaps(
    finished: Mapping[str, Array | None], results: Sequence[str], estimates: Mapping[str, Array]
) -> Balance:
    """Snaps against their results in the log (ids, one a result) and their estimates (4, 4) by id."""
    there = {
        snap_id
        for snap_id, T in finished.items()
        if snap_id in results and snap_id in estimates and (T is None or is_same(T, estimates[snap_id]))
    }
    surplus_results = len(results) - len(set(results) & set(finished))
    return Balance(
        lost=len(finished) - len(there), surplus=surplus_results + len(set(estimates) - set(finished))
    )


def is_same(T_a: Array, T_b: Array) -> bool:
    """Whether two poses (4, 4) are one."""
    return np.allclose(T_a, T_b, rtol=0.0, atol=TOLERANCE)


def _compare(database: Database, work: Finished) -> Comparison:
    with database.read() as session:
        events = session.scalars(
            select(Event).where(Event.registration_id == work.registration_id).order_by(Event.sequence)
        ).all()
        rows = session.scalars(
            select(EstimateRow).where(EstimateRow.registration_id == work.registration_id)
        ).all()
    drags = [event for event in events if event.kind == "drag"]
    expected_rows = work.updates_a_drag + ROWS_BESIDE_UPDATES
    surplus_rows = [len(event.path or ()) - expected_rows for event in drags]
    return Comparison(
        drags=compare_drags(work.drags, [np.array(event.T_after) for event in drags]),
        path_rows=Balance(
            lost=sum(-surplus for surplus in surplus_rows if surplus < 0),
            surplus=sum(surplus for surplus in surplus_rows if surplus > 0),
        ),
        snaps=compare_snaps(
            work.snaps,
            [str(event.snap_id) for event in events if event.kind in RESULTS],
            {row.snap_id: np.array(row.T_world_object) for row in rows},
        ),
    )
