"""Exports in processes of their own: done, failed, killed, interrupted."""

import os
import signal
import sqlite3
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy.exc import OperationalError

from app.config import Settings
from app.export.processes import DIED, INTERRUPTED, UNFINISHED, ExportJobs
from app.storage.database import Database
from app.storage.event_log import EventLog, NewEvent
from app.storage.files import FileStore
from app.storage.roles import Actor
from app.storage.tables import Export, Registration, User
from app.storage.unfinished import PREFIX
from tests.app.small_dataset import TOOL, true_pose
from tests.app.waiting import wait_until
from tests.processes import command_line, descendants

pytestmark = pytest.mark.slow  # exports in processes of their own


@pytest.fixture
def settings(state_dir: Path) -> Settings:
    return Settings(state_dir=state_dir)


@pytest.fixture
def database(settings: Settings) -> Iterator[Database]:
    """The imported dataset, with one registration that is submitted."""
    opened = Database(settings.resolved_database_url)
    with opened.write() as session:
        session.add(User(name="ann", role="admin"))
        session.flush()
        session.add(Registration(task_id=1, user_id=1))
    T = true_pose(TOOL).tolist()
    EventLog(opened).append(1, 1, NewEvent("submit", Actor.HUMAN, T_before=T, T_after=T))
    yield opened
    opened.close()


@pytest.fixture
def jobs(database: Database, settings: Settings) -> Iterator[ExportJobs]:
    opened = ExportJobs(database, settings)
    yield opened
    opened.close()


def row(database: Database, export: Export) -> Export:
    with database.read() as session:
        return session.get_one(Export, export.id)


def ended(database: Database, export: Export) -> Export:
    """The export when it has ended."""

    def look() -> Export | None:
        found = row(database, export)
        return found if found.state in {"done", "failed"} else None

    return wait_until(look, "the export to end")


def export_process(export: Export) -> int:
    """The process that does an export, once there is one."""

    def look() -> int | None:
        for pid in descendants(os.getpid()):
            if command_line(pid)[1:4] == ["-m", "app.export", str(export.id)]:
                return pid
        return None

    return wait_until(look, "the export's process")


def half_written(settings: Settings) -> set[Path]:
    """Folders of what is not finished."""
    return set(settings.files_dir.glob(f"{PREFIX}*"))


def test_an_export_ends_with_a_zip_in_the_store(jobs, database, settings):
    export = jobs.start(1, "bop", 1)
    assert (export.state, export.progress, export.file_hash) == ("queued", 0.0, None)
    done = ended(database, export)
    assert (done.state, done.progress) == ("done", 1.0), done.message
    assert done.file_hash is not None
    with zipfile.ZipFile(FileStore(settings.files_dir).path(done.file_hash)) as archive:
        assert archive.testzip() is None
        assert any(name.endswith("scene_gt.json") for name in archive.namelist())


def test_an_export_of_nothing_fails_with_a_sentence(jobs, database):
    with database.write() as session:
        session.get_one(Registration, 1).state = "open"
    failed = ended(database, jobs.start(1, "bop", 1))
    assert failed.state == "failed" and "submit at least one" in failed.message


def test_a_process_that_dies_fails_its_export_and_the_next_one_works(jobs, database, settings):
    first, second = jobs.start(1, "bop", 1), jobs.start(1, "bop", 1)
    folders = wait_until(lambda: half_written(settings), "the export to write something")
    os.kill(export_process(first), signal.SIGKILL)
    failed = ended(database, first)
    assert (failed.state, failed.message, failed.file_hash) == ("failed", DIED, None)
    assert not folders & half_written(settings)
    assert ended(database, second).state == "done"


def test_a_death_that_cannot_be_written_down_is_told_later(jobs, database, monkeypatch):
    def refuse(*_arguments: object) -> None:
        raise OperationalError("UPDATE exports", {}, sqlite3.OperationalError("database or disk is full"))

    monkeypatch.setattr("app.export.processes.SECONDS_BETWEEN_TRIES", 0.01)
    export = jobs.start(1, "bop", 1)
    process = export_process(export)
    with monkeypatch.context() as full:
        full.setattr(jobs, "_fail", refuse)
        os.kill(process, signal.SIGKILL)
        wait_until(lambda: not command_line(process), "the export to be gone")
        assert row(database, export).state in UNFINISHED
    assert ended(database, export).message == DIED


def test_exports_go_one_after_the_other(jobs, database):
    exports = [jobs.start(1, "bop", 1) for _ in range(3)]
    export_process(exports[0])
    assert [row(database, export).state for export in exports[1:]] == ["queued", "queued"]


def test_closing_stops_the_export_under_way(jobs, database):
    exports = [jobs.start(1, "bop", 1) for _ in range(2)]
    pid = export_process(exports[0])
    jobs.close()
    assert not command_line(pid)
    assert row(database, exports[0]).state == "failed"
    assert row(database, exports[1]).state == "queued"


def test_what_an_earlier_run_left_is_said_to_have_failed(jobs, database):
    states = ("queued", "running", "done", "failed")
    with database.write() as session:
        for state in states:
            session.add(Export(dataset_id=1, format="bop", user_id=1, state=state, message=state))
    jobs.fail_interrupted()
    with database.read() as session:
        found = [(session.get_one(Export, i).state, session.get_one(Export, i).message) for i in range(1, 5)]
    assert found == [("failed", INTERRUPTED)] * 2 + [("done", "done"), ("failed", "failed")]
