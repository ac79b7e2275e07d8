"""One archive of the database and all files that it names, also of a server at work."""

import os
import shutil
import sqlite3
import subprocess
import tarfile
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import URL

from app.storage.database import Database
from app.storage.files import FileStore, sentence_of
from app.storage.named_files import named_files
from app.storage.unfinished import clear_unfinished, unfinished

Progress = Callable[[float, str], None]


class BackupError(Exception):
    """Nothing was backed up; the message says why and what to do."""


@dataclass(frozen=True)
class Backup:
    """What an archive holds."""

    files: int
    faults: tuple[str, ...]
    """A sentence for each stored file that is damaged already; all else is in the archive."""


def back_up(database: Database, files: FileStore, target: Path, progress: Progress) -> Backup:
    """Write an archive that unpacks to a state directory; it appears whole or not at all.

    The rows are copied first, at one moment. The files come after: they are written before the rows that name
    them and never change, so that all are there however much is written meanwhile.

    Raises:
        BackupError: where the database cannot be copied.
        DatabaseError: where it is not of this version.
    """
    database.check_version()
    clear_unfinished(target.absolute().parent)
    with unfinished(target.absolute().parent) as work:
        progress(0.0, "copying the database")
        copied = _copy(database, work)
        archive = work / "backup.tar"
        archive.touch(mode=0o600)  # it holds what people sign in with
        with tarfile.open(archive, "w") as tar:
            tar.add(copied, copied.name)
            backup = _add_files(tar, database, files, progress)
        with archive.open("rb") as stream:
            os.fsync(stream.fileno())
        os.replace(archive, target)
    return backup


def _add_files(tar: tarfile.TarFile, database: Database, files: FileStore, progress: Progress) -> Backup:
    with database.read() as session:
        named = {file.digest: file for file in named_files(session)}
    faults = []
    for number, file in enumerate(named.values()):
        progress(number / len(named), "copying files")
        fault = files.fault(file.digest)
        if fault is None:
            path = files.place(file.digest)
            tar.add(path, f"files/{path.relative_to(files.root)}")
        else:
            faults.append(sentence_of(file, fault))
    return Backup(len(named) - len(faults), tuple(faults))


def _copy(database: Database, folder: Path) -> Path:
    """Write the database as it is at one moment into a file; writers go on meanwhile."""
    if database.engine.dialect.name == "sqlite":
        target = folder / "snap6d.sqlite"
        with closing(database.engine.raw_connection()) as source, closing(sqlite3.connect(target)) as copy:
            assert isinstance(source.driver_connection, sqlite3.Connection)
            source.driver_connection.backup(copy)
        return target
    target = folder / "snap6d.pgdump"
    _run_pg_dump(database.engine.url, target)
    return target


def _run_pg_dump(url: URL, target: Path) -> None:
    program = shutil.which("pg_dump")
    if program is None:
        raise BackupError(
            "pg_dump is not installed here, which copies a PostgreSQL database; install PostgreSQL's client"
            " programs (Debian: apt-get install postgresql-client)"
        )
    address = URL.create("postgresql", url.username, None, url.host, url.port, url.database, url.query)
    environment = {**os.environ, **({"PGPASSWORD": str(url.password)} if url.password else {})}
    done = subprocess.run(
        [program, "--format=custom", f"--file={target}", f"--dbname={address.render_as_string()}"],
        env=environment,  # other users see what stands on a command line
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        raise BackupError(f"the database could not be copied: {' '.join(done.stderr.split())}")
