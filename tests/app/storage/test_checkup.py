"""`snap6d check`: each kind of fault is found, named, and told with its cure."""

import sqlite3
from contextlib import closing
from pathlib import Path

from app.config import Settings
from app.storage.database import Database
from app.storage.files import FileStore
from app.storage.tables import Frame
from tests.processes import Command


def faults_of(snap6d: Command, state_dir: Path) -> list[str]:
    """What the command tells of an unsound state, a fault a line."""
    done = snap6d(state_dir, "check")
    assert done.returncode == 1, done
    assert done.stderr.endswith("faults were found; they are listed above\n")
    return done.stdout.splitlines()


def change(state_dir: Path, statement: str) -> None:
    """Change the database as no program should."""
    with closing(sqlite3.connect(state_dir / "snap6d.sqlite")) as connection, connection:
        connection.execute(statement)


def test_a_sound_state_is_said_to_be_sound(snap6d: Command, state_dir: Path) -> None:
    done = snap6d(state_dir, "check")
    assert (done.returncode, done.stdout) == (0, "The database and its 6 files are sound.\n")


def test_damaged_and_missing_files_are_named(snap6d: Command, state_dir: Path) -> None:
    database = Database(Settings(state_dir=state_dir).resolved_database_url)
    with database.read() as session:
        frame = session.get_one(Frame, 2)
    database.close()
    assert frame.color_hash is not None
    files = FileStore(state_dir / "files")
    files.path(frame.depth_hash).write_bytes(b"something else")
    files.path(frame.color_hash).unlink()
    image = "image 5 in scene 1 of dataset 'tools'"
    damaged, missing = faults_of(snap6d, state_dir)
    assert damaged.startswith(f"the depth image of {image} is damaged on the disk (file ")
    assert missing.startswith(f"the colour image of {image} is missing on the disk (file ")
    assert damaged.endswith("import dataset 'tools' again, which puts it back")


def test_files_that_no_row_names_are_counted_and_are_no_fault(snap6d: Command, state_dir: Path) -> None:
    FileStore(state_dir / "files").put_bytes(b"x" * 100_000)
    done = snap6d(state_dir, "check")
    assert done.returncode == 0
    assert done.stdout.startswith("1 files (0.1 MB) in ") and "do no harm" in done.stdout


def test_references_to_nothing_are_told(snap6d: Command, state_dir: Path) -> None:
    change(state_dir, "UPDATE frames SET scene_id = 99 WHERE id = 1")
    assert faults_of(snap6d, state_dir) == [
        "row 1 of table frames refers to a row of scenes that is not there;"
        " restore a backup (see docs/deployment.md)"
    ]


def test_a_database_of_another_version_is_told(snap6d: Command, state_dir: Path) -> None:
    change(state_dir, "UPDATE alembic_version SET version_num = '0001'")
    (fault,) = faults_of(snap6d, state_dir)
    assert "is of an older Snap6D" in fault and fault.endswith("run `snap6d migrate` to update it")


def test_a_damaged_database_is_told_in_a_sentence(snap6d: Command, state_dir: Path) -> None:
    path = state_dir / "snap6d.sqlite"
    content = bytearray(path.read_bytes())
    for page in range(4, len(content) // 4096):
        content[page * 4096 : page * 4096 + 100] = b"\xff" * 100
    path.write_bytes(content)
    faults = faults_of(snap6d, state_dir)
    assert faults[0].startswith("the database") and "restore a backup" in faults[0]
    path.write_bytes(b"no database at all" * 1000)
    (fault,) = faults_of(snap6d, state_dir)
    assert "file is not a database" in fault and fault.startswith("the database")
