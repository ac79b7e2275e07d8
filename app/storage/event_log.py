"""The append-only log of what operators and the machine did: on the disk when `append` returns."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from sqlalchemy import func, select

from app.storage.clock import Clock
from app.storage.database import Database
from app.storage.roles import Actor
from app.storage.tables import EstimateRow, Event, Pose, Registration

STATE_AFTER = {"submit": "submitted", "skip": "skipped", "reopen": "open"}
"""Events that end a registration or begin it anew, and how it stands then."""


class ErasedError(Exception):
    """A registration is not there any more: what its participant did was erased. The message may be shown."""


@dataclass(frozen=True)
class NewEvent:
    """One thing that happened, before it is written down."""

    kind: str
    actor: Actor
    T_before: Pose | None = None
    T_after: Pose | None = None
    dof: Sequence[str] | None = None
    """Degrees of freedom that a drag changed, in the gizmo's frame: tx, ty, tz, rx, ry, rz."""
    path: Sequence[Sequence[float]] | None = None
    """A drag's way: rows of seconds since its start, x, y, z [m], and the rotation as wxyz."""
    duration_seconds: float | None = None
    snap_id: str | None = None
    detail: dict[str, Any] = field(default_factory=dict)


class EventLog:
    """Writes and reads the events of registrations, each with the time on `clock`."""

    def __init__(self, database: Database, clock: Clock | None = None) -> None:
        self._database = database
        self.clock = clock or Clock()

    def append(
        self, registration_id: int, user_id: int, event: NewEvent, estimate: EstimateRow | None = None
    ) -> Event:
        """Write one event, with the estimate it brings, in one durable transaction.

        A `submit` event also closes the registration with its pose, a `skip` with its reason; a `reopen`
        event takes both back.

        Raises:
            ErasedError: where the registration was erased meanwhile.
        """
        with self._database.write() as session:
            registration = session.get(Registration, registration_id)
            if registration is None:
                raise ErasedError(f"registration {registration_id} was erased")
            last = session.scalar(
                select(func.max(Event.sequence)).where(Event.registration_id == registration_id)
            )
            row = Event(
                registration_id=registration_id,
                user_id=user_id,
                sequence=(last or 0) + 1,
                utc=self.clock.utc(),
                monotonic_seconds=self.clock.monotonic(),
                boot_id=self.clock.boot_id,
                kind=event.kind,
                actor=event.actor,
                T_before=event.T_before,
                T_after=event.T_after,
                dof=None if event.dof is None else list(event.dof),
                path=None if event.path is None else [list(row) for row in event.path],
                duration_seconds=event.duration_seconds,
                snap_id=event.snap_id,
                detail=event.detail,
            )
            session.add(row)
            if estimate is not None:
                session.add(estimate)
            if event.kind in STATE_AFTER:
                submitted = event.kind == "submit"
                registration.state = STATE_AFTER[event.kind]
                registration.T_world_object = event.T_after if submitted else None
                registration.submitted_at = row.utc if submitted else None
                registration.skip_reason = event.detail["reason"] if event.kind == "skip" else None
        return row

    def events(self, registration_id: int, after: int = 0, limit: int | None = None) -> Sequence[Event]:
        """Events of a registration in their order, from the one that follows sequence number `after`."""
        query = (
            select(Event)
            .where(Event.registration_id == registration_id, Event.sequence > after)
            .order_by(Event.sequence)
            .limit(limit)
        )
        with self._database.read() as session:
            return session.scalars(query).all()

    def snap_events(self, snap_id: str) -> Sequence[Event]:
        """The events that one snap gave rise to, in their order."""
        with self._database.read() as session:
            return session.scalars(
                select(Event).where(Event.snap_id == snap_id).order_by(Event.sequence)
            ).all()

    def estimate(self, snap_id: str) -> EstimateRow | None:
        """What a snap found, where it finished."""
        with self._database.read() as session:
            return session.scalar(select(EstimateRow).where(EstimateRow.snap_id == snap_id))
