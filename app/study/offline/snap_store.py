"""Offline snaps in the database."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from sqlalchemy import func, insert, select
from sqlalchemy.exc import IntegrityError

from app.storage.database import Database
from app.storage.tables import Method, OfflineSnap
from app.study.offline.samples import Sample

HASHES_AT_ONCE = 500

Outcome = Mapping[str, Any]
"""Columns that are the same for all samples of one input, by name: `OUTCOME`."""
OUTCOME = (
    "config",
    "method",
    "seed",
    "T_world_object",
    "confidence",
    "message",
    "snap_seconds",
    "evaluations",
    "version",
    "algorithm",
    "hardware",
)


class StoreError(Exception):
    """Offline snaps cannot be stored; the message says why and may be shown."""


class SnapStore:
    """Reads and writes offline snaps."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def stored(self, registration_id: int) -> set[tuple[float, str]]:
        """Second and input of all samples of a registration that have their snap."""
        query = select(OfflineSnap.seconds, OfflineSnap.input_hash)
        with self._database.read() as session:
            rows = session.execute(query.where(OfflineSnap.registration_id == registration_id))
            return {(row.seconds, row.input_hash) for row in rows}

    def outcomes(self, input_hashes: Sequence[str]) -> dict[str, Outcome]:
        """What is known of inputs, by their hash, whosever samples they were stored for."""
        known: dict[str, Outcome] = {}
        for begin in range(0, len(input_hashes), HASHES_AT_ONCE):
            some = input_hashes[begin : begin + HASHES_AT_ONCE]
            with self._database.read() as session:
                rows = session.scalars(select(OfflineSnap).where(OfflineSnap.input_hash.in_(some)))
                known |= {row.input_hash: {name: getattr(row, name) for name in OUTCOME} for row in rows}
        return known

    def add(self, snaps: Iterable[tuple[Sample, Outcome]]) -> None:
        """Store snaps, all together.

        Raises:
            StoreError: where one of them is there already.
        """
        rows = [
            {
                "registration_id": sample.registration_id,
                "seconds": sample.seconds,
                "T_world_object_start": sample.T_world_object.tolist(),
                "input_hash": sample.input_hash,
                **outcome,
            }
            for sample, outcome in snaps
        ]
        try:
            with self._database.write() as session:
                session.execute(insert(OfflineSnap), rows)
        except IntegrityError as error:
            raise StoreError(
                "Another batch stores the offline snaps of the same registrations. Let one of them end first."
            ) from error

    def median_seconds(self, registration_ids: Sequence[int], method: Method = "default") -> float:
        """What the snaps of registrations took, each counting once, as measured; NaN where there are none."""
        query = select(OfflineSnap.input_hash, OfflineSnap.snap_seconds)
        with self._database.read() as session:
            rows = session.execute(
                query.where(OfflineSnap.registration_id.in_(registration_ids), OfflineSnap.method == method)
            )
            seconds = {row.input_hash: row.snap_seconds for row in rows}
        return float(np.median(list(seconds.values()))) if seconds else np.nan

    def failures(self, registration_ids: Sequence[int], method: Method) -> int:
        """How many samples of registrations have a snap that failed."""
        failed = (
            OfflineSnap.registration_id.in_(registration_ids),
            OfflineSnap.method == method,
            OfflineSnap.message != "",
        )
        with self._database.read() as session:
            return session.scalar(select(func.count()).select_from(OfflineSnap).where(*failed)) or 0
