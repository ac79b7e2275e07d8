"""The database: engine, pragmas, transactions, and whether its tables fit this version."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, create_engine, event, func, select
from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError, DBAPIError
from sqlalchemy.orm import Session

from app.resources import MIGRATIONS
from app.storage.faults import advice

BUSY_TIMEOUT_SECONDS = 20
SERVER_LOCK = int.from_bytes(b"Snap6D")
"""Number of PostgreSQL's advisory lock that a server holds."""


class DatabaseError(Exception):
    """The database cannot be used; the message says why and what to do."""


class Database:
    """Transactions on one database.

    A write is on the disk when its block ends: SQLite runs with a write-ahead log, synced at each commit.
    """

    def __init__(self, url: str) -> None:
        try:
            self._is_sqlite = make_url(url).get_backend_name() == "sqlite"
            self.engine = create_engine(
                url, connect_args=self._connect_args(), pool_pre_ping=not self._is_sqlite
            )
        except (ArgumentError, ModuleNotFoundError) as error:
            raise DatabaseError(f"the database address is no SQLAlchemy address: {error}") from error
        # One writer at a time in this process: waiting here is fair and quick, SQLite's own wait is neither.
        self._write_lock = threading.Lock()
        if self._is_sqlite:
            event.listen(self.engine, "connect", _set_sqlite_pragmas)
            event.listen(self.engine, "begin", _begin_sqlite)

    def _connect_args(self) -> dict[str, Any]:
        return {"timeout": BUSY_TIMEOUT_SECONDS, "check_same_thread": False} if self._is_sqlite else {}

    @contextmanager
    def read(self) -> Iterator[Session]:
        """A session for reading; what it loads stays usable after it closes."""
        with Session(self.engine, expire_on_commit=False) as session:
            yield session

    @contextmanager
    def write(self) -> Iterator[Session]:
        """A session whose changes are committed, durably and all together, when the block ends."""
        engine = self.engine.execution_options(snap6d_write=True)
        with self._write_lock, Session(engine, expire_on_commit=False) as session, session.begin():
            yield session

    def is_new(self) -> bool:
        """Whether it holds no tables yet."""
        return self._revision() is None

    def check_version(self) -> None:
        """Raise `DatabaseError` unless the tables are those of this version."""
        found = self._revision()
        wanted = ScriptDirectory.from_config(_alembic_config()).get_current_head()
        if found == wanted:
            return
        if found is None:
            raise DatabaseError("the database is empty; run `snap6d migrate` first")
        if found not in _known_revisions():
            raise DatabaseError(
                f"the database was made by a newer Snap6D (revision {found}); update Snap6D to open it"
            )
        raise DatabaseError(
            f"the database is of an older Snap6D (revision {found}); run `snap6d migrate` to update it"
        )

    def _revision(self) -> str | None:
        try:
            with self.engine.connect() as connection:
                return MigrationContext.configure(connection).get_current_revision()
        except DBAPIError as error:
            raise DatabaseError(f"the database cannot be opened: {advice(error) or error.orig}") from error

    def migrate(self) -> None:
        """Bring the tables up to this version; nothing happens where they are."""
        config = _alembic_config()
        with self._migrating() as connection:
            found = MigrationContext.configure(connection).get_current_revision()
            if found is not None and found not in _known_revisions():
                raise DatabaseError(
                    f"the database was made by a newer Snap6D (revision {found}); update Snap6D to open it"
                )
            config.attributes["connection"] = connection
            command.upgrade(config, "head")

    @contextmanager
    def _migrating(self) -> Iterator[Connection]:
        """A transaction that changes tables, all or nothing.

        SQLite copies a table to change it, and what refers to it must not mind; all references are checked
        before the transaction ends.
        """
        with self.engine.execution_options(snap6d_write=True).connect() as connection:
            if self._is_sqlite:
                _set_foreign_keys(connection, "OFF")
            try:
                with connection.begin():
                    yield connection
                    if self._is_sqlite and connection.exec_driver_sql("PRAGMA foreign_key_check").first():
                        raise DatabaseError(
                            "the database has rows that refer to missing ones; restore a backup of it"
                        )
            finally:
                if self._is_sqlite:
                    _set_foreign_keys(connection, "ON")

    @contextmanager
    def kept_to_one_server(self) -> Iterator[None]:
        """Keep a PostgreSQL database to this server until the block ends, however it ends.

        Two would fail each other's exports, and lack each other's files. An SQLite database lies in the state
        folder, which is one server's already.

        Raises:
            DatabaseError: where another server works on it.
        """
        if self._is_sqlite:
            yield
            return
        with self.engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
            if not connection.scalar(select(func.pg_try_advisory_lock(SERVER_LOCK))):
                raise DatabaseError(
                    "another Snap6D server works on this database; stop that one, or give this one a database"
                    " of its own by --database-url"
                )
            try:
                yield
            finally:
                connection.scalar(select(func.pg_advisory_unlock(SERVER_LOCK)))

    def close(self) -> None:
        """Close all connections."""
        self.engine.dispose()


def _alembic_config() -> Config:
    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS))
    return config


def _known_revisions() -> set[str]:
    return {script.revision for script in ScriptDirectory.from_config(_alembic_config()).walk_revisions()}


def _set_sqlite_pragmas(connection: Any, _record: Any) -> None:
    connection.isolation_level = None  # transactions begin where `_begin_sqlite` says
    # Without recursive triggers, INSERT OR REPLACE would slip past those that keep the log append-only.
    for pragma in ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON", "recursive_triggers=ON"):
        connection.execute(f"PRAGMA {pragma}")


def _set_foreign_keys(connection: Connection, value: str) -> None:
    # on the driver's connection: SQLite ignores it within a transaction, which SQLAlchemy would begin
    driver_connection = connection.connection.driver_connection
    assert driver_connection is not None
    driver_connection.execute(f"PRAGMA foreign_keys={value}")


def _begin_sqlite(connection: Connection) -> None:
    # A writer takes the lock at once: one that reads first cannot be made a writer later.
    writing = connection.get_execution_options().get("snap6d_write", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writing else "BEGIN")
