"""The log: in order, with the server's clock, and what it closes."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import select
from sqlalchemy.exc import IntegrityError

from app.datasets.importing import import_dataset
from app.storage.clock import BOOT_ID
from app.storage.database import Database
from app.storage.event_log import ErasedError, EventLog, NewEvent
from app.storage.files import FileStore
from app.storage.roles import Actor
from app.storage.tables import EstimateRow, Registration, Task, User
from app.study.erasing import erase_registrations
from registration_core.geometry import pose


@pytest.fixture
def registrations(database: Database, files: FileStore, demo: Path) -> list[int]:
    """Two open registrations of one user."""
    import_dataset(database, files, demo)
    with database.write() as session:
        user = User(name="ann", role="operator")
        session.add(user)
        session.flush()
        rows = [
            Registration(task_id=task, user_id=user.id) for task in session.scalars(select(Task.id)).all()[:2]
        ]
        session.add_all(rows)
        session.flush()
        return [row.id for row in rows]


@pytest.fixture
def log(database: Database) -> EventLog:
    return EventLog(database)


def estimate(snap_id: str, registration_id: int) -> EstimateRow:
    T = pose.exp([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    return EstimateRow(
        snap_id=snap_id,
        registration_id=registration_id,
        frame_id=1,
        T_world_object_start=np.eye(4).tolist(),
        T_world_object=T.tolist(),
        T_camera_object=T.tolist(),
        confidence=0.5,
        covariance=np.eye(6).tolist(),
        hypotheses=[{"T_camera_object": T.tolist(), "weight": 1.0}],
        converged=True,
        seed=2**62,
        config={"method": "viewpoint"},
        version="1",
        hardware="x",
        seconds=0.1,
        evaluations=1,
    )


def test_all_of_an_event_comes_back(log, registrations):
    T_before, T_after = np.eye(4).tolist(), pose.exp([0.1, 1 / 3, np.pi, 0.4, 0.5, 0.6]).tolist()
    path = [[0.0, 1, 2, 3, 1, 0, 0, 0], [0.05, 1, 2, 4, 1, 0, 0, 0]]
    event = NewEvent(
        kind="drag",
        actor=Actor.HUMAN,
        T_before=T_before,
        T_after=T_after,
        dof=("tx", "rz"),
        path=path,
        duration_seconds=0.05,
        snap_id="abc",
        detail={"note": "ü"},
    )
    log.append(registrations[0], 1, event)
    (row,) = log.events(registrations[0])
    assert (row.kind, row.actor, row.user_id, row.sequence, row.snap_id) == ("drag", "human", 1, 1, "abc")
    assert row.T_before == T_before and row.T_after == T_after  # to the last bit
    assert row.dof == ["tx", "rz"] and row.duration_seconds == 0.05 and row.detail == {"note": "ü"}
    assert row.path == [list(map(float, line)) for line in path]


def test_the_clock_is_the_servers(log, registrations):
    before = datetime.now(UTC)
    rows = [log.append(registrations[0], 1, NewEvent("opened", Actor.HUMAN)) for _ in range(3)]
    after = datetime.now(UTC)
    assert before <= rows[0].utc <= rows[-1].utc <= after
    assert log.events(registrations[0])[0].utc == rows[0].utc
    assert rows[0].monotonic_seconds < rows[1].monotonic_seconds < rows[2].monotonic_seconds
    assert {row.boot_id for row in rows} == {BOOT_ID}


def test_each_registration_counts_for_itself(log, registrations):
    for registration_id in (registrations[0], registrations[1], registrations[0]):
        log.append(registration_id, 1, NewEvent("opened", Actor.HUMAN))
    assert [row.sequence for row in log.events(registrations[0])] == [1, 2]
    assert [row.sequence for row in log.events(registrations[1])] == [1]


def test_events_come_in_parts(log, registrations):
    for i in range(5):
        log.append(registrations[0], 1, NewEvent("opened", Actor.HUMAN, detail={"i": i}))
    assert [row.detail["i"] for row in log.events(registrations[0], after=1, limit=2)] == [1, 2]
    assert log.events(registrations[0], after=5) == []


def test_an_event_and_its_estimate_come_together_or_not_at_all(log, registrations):
    requested = NewEvent("snap_requested", Actor.HUMAN, snap_id="s1")
    applied = NewEvent("snap_applied", Actor.MACHINE, snap_id="s1")
    log.append(registrations[0], 1, requested)
    assert log.estimate("s1") is None
    log.append(registrations[0], 1, applied, estimate("s1", registrations[0]))
    found = log.estimate("s1")
    assert found is not None and found.seed == 2**62 and found.hypotheses[0]["weight"] == 1.0
    assert [row.kind for row in log.snap_events("s1")] == ["snap_requested", "snap_applied"]
    with pytest.raises(IntegrityError, match=r"(?i)unique"):
        log.append(registrations[0], 1, applied, estimate("s1", registrations[0]))
    assert len(log.events(registrations[0])) == 2


def test_a_submission_closes_the_registration_with_its_pose(log, registrations, database):
    T = pose.exp([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]).tolist()
    row = log.append(registrations[0], 1, NewEvent("submit", Actor.HUMAN, T_before=T, T_after=T))
    with database.read() as session:
        closed, other = session.scalars(select(Registration).order_by(Registration.id))
    assert (closed.state, closed.T_world_object, closed.submitted_at) == ("submitted", T, row.utc)
    assert (other.state, other.T_world_object, other.submitted_at) == ("open", None, None)


def test_a_skip_closes_the_registration_without_a_pose_and_reopening_clears_all(log, registrations, database):
    def closed() -> tuple[object, ...]:
        with database.read() as session:
            row = session.get_one(Registration, registrations[0])
        return row.state, row.T_world_object, row.submitted_at, row.skip_reason

    T = np.eye(4).tolist()
    reopened = ("open", None, None, None)
    log.append(registrations[0], 1, NewEvent("skip", Actor.HUMAN, detail={"reason": "no depth"}))
    assert closed() == ("skipped", None, None, "no depth")
    log.append(registrations[0], 1, NewEvent("reopen", Actor.HUMAN, T_before=T, T_after=T))
    assert closed() == reopened
    log.append(registrations[0], 1, NewEvent("submit", Actor.HUMAN, T_before=T, T_after=T))
    assert closed()[:2] == ("submitted", T)
    log.append(registrations[0], 1, NewEvent("reopen", Actor.HUMAN, T_before=T, T_after=T))
    assert closed() == reopened


def test_an_event_of_nobody_is_refused(log, registrations):
    with pytest.raises(ErasedError, match="registration 99 was erased"):
        log.append(99, 99, NewEvent("opened", Actor.HUMAN))
    with pytest.raises(IntegrityError, match=r"(?i)foreign key"):
        log.append(registrations[0], 99, NewEvent("opened", Actor.HUMAN))


def test_what_was_erased_is_not_gone_on_with(database, log, registrations):
    erased, kept = registrations[0], registrations[1]
    log.append(erased, 1, NewEvent("opened", Actor.HUMAN))
    with database.write() as session:
        erase_registrations(session, 1)
    for registration_id in (erased, kept):
        with pytest.raises(ErasedError, match=f"registration {registration_id} was erased"):
            log.append(registration_id, 1, NewEvent("undo", Actor.HUMAN))
        assert log.events(registration_id) == []
