"""Erasing: all of one user's, nothing of another's, and the log is append-only as before."""

import pytest
from sqlalchemy import delete, func, select, text, update
from sqlalchemy.exc import DBAPIError

from app.storage.event_log import EventLog, NewEvent
from app.storage.roles import Actor
from app.storage.tables import EstimateRow, Event, Frame, Registration, Task, User
from app.study.erasing import erase_registrations


def work_of(database, name):
    """A user with one registration that has an event and an estimate."""
    with database.write() as session:
        user = User(name=name, role="participant")
        session.add(user)
        session.flush()
        row = Registration(task_id=session.scalars(select(Task.id)).first(), user_id=user.id)
        session.add(row)
        session.flush()
        frame_id = session.scalars(select(Frame.id)).first()
    estimate = EstimateRow(
        snap_id=name,
        registration_id=row.id,
        frame_id=frame_id,
        T_world_object_start=[],
        T_world_object=[],
        T_camera_object=[],
        confidence=0.5,
        covariance=[],
        hypotheses=[],
        converged=True,
        seed=1,
        config={},
        version="1",
        hardware="x",
        seconds=0.1,
        evaluations=1,
    )
    EventLog(database).append(
        row.id, user.id, NewEvent("snap_applied", Actor.MACHINE, snap_id=name), estimate
    )
    return user.id


@pytest.mark.usefixtures("studies")
def test_all_of_one_user_goes_and_all_of_another_stays(database):
    gone, kept = work_of(database, "gone"), work_of(database, "kept")
    with database.write() as session:
        erase_registrations(session, gone)
    with database.read() as session:
        assert session.scalars(select(Registration.user_id)).all() == [kept]
        assert session.scalars(select(Event.user_id)).all() == [kept]
        assert session.scalars(select(EstimateRow.snap_id)).all() == ["kept"]


@pytest.mark.usefixtures("studies")
def test_the_number_of_the_erased_is_not_given_again(database):
    """Pages, logs and exports of before still know the erased under it."""

    def registration_of(user_id):
        with database.read() as session:
            return session.scalar(select(Registration.id).filter_by(user_id=user_id))

    gone = work_of(database, "gone")
    number = registration_of(gone)
    with database.write() as session:
        erase_registrations(session, gone)
    assert registration_of(work_of(database, "next")) > number


@pytest.mark.usefixtures("studies")
@pytest.mark.parametrize("interrupted", [False, True])
def test_the_log_is_append_only_afterwards(database, interrupted):
    gone, _ = work_of(database, "gone"), work_of(database, "kept")
    if interrupted:
        with pytest.raises(RuntimeError, match="in the middle"), database.write() as session:
            erase_registrations(session, gone)
            raise RuntimeError("in the middle")
    else:
        with database.write() as session:
            erase_registrations(session, gone)
    with database.read() as session:
        assert session.scalar(select(func.count(Event.id))) == (2 if interrupted else 1)
    for table, column in ((Event, "kind"), (EstimateRow, "version")):
        for statement in (update(table).values({column: "forged"}), delete(table)):
            with pytest.raises(DBAPIError, match="append-only"), database.write() as session:
                session.execute(statement)
    with database.read() as session:
        assert session.scalar(text("SELECT count(*) FROM sqlite_master WHERE type = 'trigger'")) == 6
