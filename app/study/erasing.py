"""Erasing what a participant did: the one exception to the append-only log."""

from collections.abc import Iterator
from contextlib import contextmanager

from sqlalchemy import delete, select, text
from sqlalchemy.orm import Session

from app.storage.tables import EstimateRow, Event, OfflineSnap, Registration

APPEND_ONLY = (EstimateRow, Event)


def erase_registrations(session: Session, user_id: int) -> None:
    """Delete a user's registrations with their events and estimates, within the session's transaction.

    The triggers that keep these tables append-only are lifted and restored in the same transaction: it
    either has erased all and left them as they were, or done nothing. Nobody else can write meanwhile.
    """
    mine = select(Registration.id).where(Registration.user_id == user_id).scalar_subquery()
    session.execute(delete(OfflineSnap).where(OfflineSnap.registration_id.in_(mine)))
    with _changeable(session):
        for table in APPEND_ONLY:
            session.execute(delete(table).where(table.registration_id.in_(mine)))
    session.execute(delete(Registration).where(Registration.user_id == user_id))


@contextmanager
def _changeable(session: Session) -> Iterator[None]:
    names = [table.__tablename__ for table in APPEND_ONLY]
    if session.get_bind().dialect.name == "sqlite":
        # SQLite cannot switch a trigger off; its changes of tables belong to the transaction, too
        triggers = session.execute(
            text("SELECT name, sql FROM sqlite_master WHERE type = 'trigger' AND tbl_name IN (:a, :b)"),
            dict(zip("ab", names, strict=True)),
        ).all()
        for name, _ in triggers:
            session.execute(text(f"DROP TRIGGER {name}"))
        yield
        for _, sql in triggers:
            session.execute(text(sql))
        return
    for name in names:
        session.execute(text(f"ALTER TABLE {name} DISABLE TRIGGER {name}_append_only"))
    yield
    for name in names:
        session.execute(text(f"ALTER TABLE {name} ENABLE TRIGGER {name}_append_only"))
