"""The database: pragmas, durable and atomic writes, versions, and tables that cannot be rewritten."""

import shutil
import sqlite3
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from alembic.script import ScriptDirectory
from sqlalchemy import delete, func, select, text, update
from sqlalchemy.exc import DBAPIError, IntegrityError

import app.storage.database
from app.datasets.importing import import_dataset
from app.resources import MIGRATIONS
from app.storage.database import Database, DatabaseError
from app.storage.event_log import EventLog, NewEvent
from app.storage.files import FileStore
from app.storage.roles import Actor
from app.storage.tables import Base, Dataset, EstimateRow, Event, Registration, Task, User
from tests.conftest import REPOSITORY

HEAD = ScriptDirectory(str(MIGRATIONS)).get_current_head()
"""The revision of this version's tables."""

LATER_REVISION = '''
"""A change of a later version."""
from alembic import op

revision = "later"
down_revision = "{head}"


def upgrade() -> None:
    op.execute("CREATE TABLE later (id INTEGER)")
'''


def path_of(database: Database) -> Path:
    return Path(str(database.engine.url.database))


def pragma(database: Database, name: str) -> object:
    with database.engine.connect() as connection:
        return connection.exec_driver_sql(f"PRAGMA {name}").scalar()


@pytest.fixture
def registration_id(database: Database, files: FileStore, demo: Path) -> int:
    """An open registration."""
    import_dataset(database, files, demo)
    with database.write() as session:
        user = User(name="ann", role="operator")
        session.add(user)
        session.flush()
        row = Registration(task_id=session.scalars(select(Task.id)).first(), user_id=user.id)
        session.add(row)
        session.flush()
        return row.id


def test_sqlite_syncs_every_commit_and_checks_references(database):
    assert pragma(database, "journal_mode") == "wal"
    assert pragma(database, "synchronous") == 2  # FULL
    assert pragma(database, "foreign_keys") == 1
    assert pragma(database, "busy_timeout") == 20_000


def test_a_reference_to_nothing_is_refused(database):
    with pytest.raises(DBAPIError, match="FOREIGN KEY"), database.write() as session:
        session.add(Registration(task_id=99, user_id=99))


def test_a_write_is_whole_or_not_at_all(database):
    with pytest.raises(RuntimeError, match="in the middle"), database.write() as session:
        session.add(Dataset(name="first"))
        session.flush()
        raise RuntimeError("in the middle")
    with database.read() as session:
        assert session.scalars(select(Dataset)).all() == []


def test_what_was_written_survives_the_sudden_death_of_its_process(tmp_path):
    code = f"""
import os, signal
from app.storage.database import Database
from app.storage.tables import Dataset
database = Database("sqlite:///{tmp_path / "x.sqlite"}")
database.migrate()
with database.write() as session:
    session.add(Dataset(name="kept"))
with database.write() as session:
    session.add(Dataset(name="unfinished"))
    session.flush()
    os.kill(os.getpid(), signal.SIGKILL)
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=REPOSITORY, capture_output=True, check=False)
    assert done.returncode == -9, done.stderr
    database = Database(f"sqlite:///{tmp_path / 'x.sqlite'}")
    with database.read() as session:
        assert session.scalars(select(Dataset.name)).all() == ["kept"]
    database.close()


def test_what_was_read_stays_usable(database):
    with database.write() as session:
        session.add(Dataset(name="kept"))
    with database.read() as session:
        row = session.scalar(select(Dataset))
    assert row.name == "kept" and row.created_at.tzinfo is not None


def test_writers_from_many_threads_lose_nothing(database, registration_id):
    log = EventLog(database)
    errors: list[Exception] = []

    def write(writer: int) -> None:
        try:
            for i in range(25):
                log.append(registration_id, 1, NewEvent("drag", Actor.HUMAN, detail={"by": [writer, i]}))
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=write, args=(i,)) for i in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
    events = log.events(registration_id)
    assert [event.sequence for event in events] == list(range(1, 201))
    assert {tuple(event.detail["by"]) for event in events} == {(w, i) for w in range(8) for i in range(25)}
    for writer in range(8):
        assert [e.detail["by"][1] for e in events if e.detail["by"][0] == writer] == list(range(25))


def test_another_process_that_writes_is_waited_for(database):
    other = sqlite3.connect(path_of(database), isolation_level=None, check_same_thread=False)
    other.execute("BEGIN IMMEDIATE")
    other.execute("INSERT INTO datasets (name, created_at) VALUES ('theirs', '2026-01-01')")
    began, done = threading.Event(), threading.Event()

    def write() -> None:
        began.set()
        with database.write() as session:
            session.add(Dataset(name="ours"))
        done.set()

    thread = threading.Thread(target=write)
    thread.start()
    assert began.wait(10)
    assert not done.wait(0.2)
    other.execute("COMMIT")
    other.close()
    thread.join(30)
    assert done.is_set()
    with database.read() as session:
        assert set(session.scalars(select(Dataset.name))) == {"theirs", "ours"}


def test_readers_do_not_wait_for_a_writer(database):
    with database.write() as session:
        session.add(Dataset(name="not yet"))
        session.flush()
        with database.read() as other:
            assert other.scalar(select(func.count(Dataset.id))) == 0


# -- append-only


def add_estimate(database: Database, registration_id: int) -> None:
    EventLog(database).append(
        registration_id,
        1,
        NewEvent("snap_applied", Actor.MACHINE, snap_id="s"),
        EstimateRow(
            snap_id="s",
            registration_id=registration_id,
            frame_id=1,
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
        ),
    )


@pytest.mark.parametrize(("table", "column"), [(Event, "kind"), (EstimateRow, "version")])
def test_the_log_can_only_grow(database, registration_id, table, column):
    add_estimate(database, registration_id)
    name = table.__tablename__
    for statement in (
        update(table).values({column: "forged"}),
        delete(table),
        text(f"UPDATE {name} SET {column} = 'forged' WHERE id = 1"),
        text(f"DELETE FROM {name} WHERE id = 1"),
        text(f"INSERT OR REPLACE INTO {name} SELECT * FROM {name}"),
    ):
        with pytest.raises(DBAPIError, match=f"{name} is append-only"), database.write() as session:
            session.execute(statement)
    with database.read() as session:
        (row,) = session.scalars(select(table)).all()
        assert getattr(row, column) != "forged"


# -- versions


@pytest.fixture
def later_revision(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """This version becomes one that has another migration; its folder."""
    project = tmp_path / "project"
    shutil.copytree(MIGRATIONS, project / "migrations")
    (project / "migrations/versions/later.py").write_text(LATER_REVISION.format(head=HEAD))
    monkeypatch.setattr(app.storage.database, "MIGRATIONS", project / "migrations")
    return project


def test_a_database_of_this_version_is_fine(database):
    database.check_version()
    database.migrate()
    database.check_version()


def test_an_empty_database_says_what_to_do(tmp_path):
    empty = Database(f"sqlite:///{tmp_path / 'new.sqlite'}")
    with pytest.raises(DatabaseError, match="empty; run `snap6d migrate` first"):
        empty.check_version()
    empty.close()


def test_an_older_database_says_what_to_do_and_can_be_updated(database, later_revision):
    with pytest.raises(DatabaseError, match=rf"older Snap6D \(revision {HEAD}\); run `snap6d migrate`"):
        database.check_version()
    with database.write() as session:
        session.add(Dataset(name="kept"))
    database.migrate()
    database.check_version()
    with database.read() as session:
        assert session.scalars(select(Dataset.name)).all() == ["kept"]
        assert session.scalars(text("SELECT * FROM later")).all() == []


@pytest.fixture
def first_version(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Database:
    """A database as the first version left it: with an estimate made before anyone told a spread."""
    project = tmp_path / "first"
    shutil.copytree(MIGRATIONS, project / "migrations")
    for later in sorted((project / "migrations/versions").glob("0*.py"))[1:]:
        later.unlink()
    with monkeypatch.context() as patch:
        patch.setattr(app.storage.database, "MIGRATIONS", project / "migrations")
        database = Database(f"sqlite:///{tmp_path / 'first.sqlite'}")
        database.migrate()
    with sqlite3.connect(path_of(database)) as connection:  # which does not check references
        for table in (
            "users",
            "datasets",
            "objects",
            "scenes",
            "frames",
            "tasks",
            "registrations",
            "estimates",
        ):
            columns = connection.execute(f"PRAGMA table_info({table})").fetchall()
            values = {"JSON": "'[]'", "DATETIME": "'2026-01-01'"}
            row = ", ".join(values.get(column[2], "1") for column in columns)
            connection.execute(f"INSERT INTO {table} VALUES ({row})")
    connection.close()
    return database


def test_estimates_of_the_first_version_stay_as_they_are_and_say_no_more(first_version):
    first_version.migrate()
    first_version.check_version()
    with first_version.read() as session:
        (row,) = session.scalars(select(EstimateRow)).all()
    assert row.start_spread is None and row.ambiguities is None and row.known_objects is None
    assert row.symmetries_version is None
    assert row.certificates is None and row.assessment is None
    for statement in (update(EstimateRow).values(start_spread=[0.1, 0.1]), delete(EstimateRow)):
        with pytest.raises(DBAPIError, match="append-only"), first_version.write() as session:
            session.execute(statement)
    first_version.close()


def test_what_a_copied_table_is_referred_to_by_still_refers_to_it(first_version):
    first_version.migrate()
    with pytest.raises(IntegrityError), first_version.write() as session:
        session.execute(text("DELETE FROM registrations"))
    with pytest.raises(IntegrityError), first_version.write() as session:
        session.execute(
            text(
                "INSERT INTO registrations SELECT 9, 8, user_id, state, T_world_object,"
                " created_at, submitted_at, skip_reason FROM registrations"
            )
        )
    first_version.close()


def test_rows_that_refer_to_none_end_a_migration(first_version):
    with sqlite3.connect(path_of(first_version)) as connection:
        connection.execute("DELETE FROM registrations")
    connection.close()
    with pytest.raises(DatabaseError, match="refer to missing ones; restore a backup"):
        first_version.migrate()
    with pytest.raises(DatabaseError, match="older Snap6D"):
        first_version.check_version()
    first_version.close()


def test_a_newer_database_is_left_alone(database):
    with database.write() as session:
        session.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    for use in (database.check_version, database.migrate):
        with pytest.raises(DatabaseError, match=r"newer Snap6D \(revision 9999\); update Snap6D"):
            use()
    with database.read() as session:
        assert session.scalar(text("SELECT version_num FROM alembic_version")) == "9999"


def test_a_migration_that_fails_leaves_nothing_behind(tmp_path, later_revision):
    later = later_revision / "migrations/versions/later.py"
    later.write_text(later.read_text().replace("CREATE TABLE later (id INTEGER)", "CREATE NONSENSE"))
    broken = Database(f"sqlite:///{tmp_path / 'new.sqlite'}")
    with pytest.raises(DBAPIError, match="NONSENSE"):
        broken.migrate()
    with broken.read() as session:
        assert session.scalars(text("SELECT name FROM sqlite_master")).all() == []
    broken.close()


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("nonsense", "no SQLAlchemy address"),
        ("martian://host/db", "no SQLAlchemy address"),
        ("sqlite:////nowhere/at/all.sqlite", "cannot be opened: unable to open database file"),
    ],
)
def test_an_address_that_leads_nowhere_is_said(url, message):
    with pytest.raises(DatabaseError, match=message):
        Database(url).check_version()


def test_a_file_that_is_no_database_is_said(tmp_path):
    (tmp_path / "x.sqlite").write_text("hello " * 1000)
    wrong = Database(f"sqlite:///{tmp_path / 'x.sqlite'}")
    with pytest.raises(DatabaseError, match="cannot be opened"):
        wrong.check_version()
    wrong.close()


def test_the_migrations_make_what_the_code_expects(database):
    with database.engine.connect() as connection:
        for table in Base.metadata.sorted_tables:
            found = {row[1] for row in connection.exec_driver_sql(f"PRAGMA table_info({table.name})")}
            assert found == set(table.columns.keys()), table.name
