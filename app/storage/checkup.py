"""Examines the database and the file store: what is wrong with them, and what to do about it."""

from collections.abc import Callable
from dataclasses import dataclass

from sqlalchemy.exc import DBAPIError

from app.storage.database import Database, DatabaseError
from app.storage.files import FileStore, sentence_of
from app.storage.named_files import named_files
from app.storage.unfinished import PREFIX

Progress = Callable[[float, str], None]
RESTORE = "restore a backup (see docs/deployment.md)"


@dataclass(frozen=True)
class Checkup:
    """What was found."""

    faults: tuple[str, ...]
    """A sentence each."""
    files: int
    """How many rows name, and were read."""
    unnamed: int
    """Files that no row names, of interrupted imports: they do no harm."""
    unnamed_bytes: int


def examine(database: Database, files: FileStore, progress: Progress) -> Checkup:
    """Examine all of it; what cannot be looked at since something else is broken is left out."""
    try:
        faults = _faults_of(database)
        database.check_version()
        with database.read() as session:
            named = {file.digest: file for file in named_files(session)}
    except DatabaseError as error:
        return Checkup((str(error),), 0, 0, 0)
    except DBAPIError as error:
        return Checkup((f"the database cannot be read ({error.orig}); {RESTORE}",), 0, 0, 0)
    for number, file in enumerate(named.values()):
        progress(number / len(named), "reading files")
        fault = files.fault(file.digest)
        if fault is not None:
            faults.append(sentence_of(file, fault))
    sizes = [
        path.stat().st_size
        for path in files.root.rglob("*")
        if path.is_file() and path.name not in named and not path.parent.name.startswith(PREFIX)
    ]
    return Checkup(tuple(faults), len(named), len(sizes), sum(sizes))


def _faults_of(database: Database) -> list[str]:
    """What SQLite finds in its file and among the references; PostgreSQL looks after both by itself."""
    if database.engine.dialect.name != "sqlite":
        return []
    with database.engine.connect() as connection:
        integrity = connection.exec_driver_sql("PRAGMA integrity_check").scalars().all()
        references = connection.exec_driver_sql("PRAGMA foreign_key_check").all()
    damaged = (
        [] if list(integrity) == ["ok"] else [f"the database's file is damaged ({integrity[0]}); {RESTORE}"]
    )
    return damaged + [
        f"row {row} of table {table} refers to a row of {parent} that is not there; {RESTORE}"
        for table, row, parent, _ in references
    ]
