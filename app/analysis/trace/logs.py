"""The logs of many registrations, read in bulk: columns instead of objects, poses decoded once."""

from collections.abc import Iterator, Sequence
from datetime import datetime
from itertools import groupby
from operator import itemgetter
from typing import Any, NamedTuple

import msgspec
from sqlalchemy import Text, cast, select

from app.storage.database import Database
from app.storage.tables import Event

Row = tuple[float, float, float, float]
PathRow = tuple[float, float, float, float, float, float, float, float]
"""Numbers in tuples: the garbage collector leaves them alone, where lists keep it busy."""

REGISTRATIONS_AT_ONCE = 100
ROWS_AT_ONCE = 2000


class LoggedRow(NamedTuple):
    """What the analysis needs of an event."""

    sequence: int
    kind: str
    actor: str
    utc: datetime
    monotonic_seconds: float
    boot_id: str
    duration_seconds: float | None
    snap_id: str | None
    T_after: tuple[Row, Row, Row, Row] | None
    path: list[PathRow] | None
    detail_text: str

    @property
    def detail(self) -> dict[str, Any]:
        """What else was written down; decoded where it is asked for."""
        return msgspec.json.decode(self.detail_text)


COLUMNS = (
    Event.registration_id,
    Event.sequence,
    Event.kind,
    Event.actor,
    Event.utc,
    Event.monotonic_seconds,
    Event.boot_id,
    Event.duration_seconds,
    Event.snap_id,
    cast(Event.T_after, Text),
    cast(Event.path, Text),
    cast(Event.detail, Text),
)


_pose_decoder = msgspec.json.Decoder(tuple[Row, Row, Row, Row])
_path_decoder = msgspec.json.Decoder(list[PathRow])


def read_logs(database: Database, registration_ids: Sequence[int]) -> Iterator[tuple[int, list[LoggedRow]]]:
    """The events of each registration in their order; registrations without any are passed by."""
    ids = sorted(registration_ids)
    for begin in range(0, len(ids), REGISTRATIONS_AT_ONCE):
        query = (
            select(*COLUMNS)
            .where(Event.registration_id.in_(ids[begin : begin + REGISTRATIONS_AT_ONCE]))
            .order_by(Event.registration_id, Event.sequence)
            .execution_options(yield_per=ROWS_AT_ONCE)
        )
        with database.read() as session:
            for registration_id, rows in groupby(session.execute(query), key=itemgetter(0)):
                yield (
                    registration_id,
                    [
                        LoggedRow._make((*plain, decoded_pose(T_after), _decoded_path(path), detail))
                        for _, *plain, T_after, path, detail in rows
                    ],
                )


def decoded_pose(text: str | None) -> tuple[Row, Row, Row, Row] | None:
    """A pose of a JSON column that was read as text: many times as quick as through the column's type."""
    return None if text is None else _pose_decoder.decode(text)


def _decoded_path(text: str | None) -> list[PathRow] | None:
    return None if text is None else _path_decoder.decode(text)
