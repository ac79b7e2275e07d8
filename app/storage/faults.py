"""What people are told where the disk, or the database on it, does not take what is written."""

import errno
import sqlite3

from sqlalchemy.exc import DBAPIError

FULL = "the disk is full; free some space and do it again"
READ_ONLY = "the disk is read-only; make it writable and do it again"
NOT_OPENED = "unable to open database file; see to it that its folder is there and can be written to"

_ADVICE_BY_CODE = {
    "SQLITE_FULL": FULL,
    "SQLITE_IOERR_SHMSIZE": FULL,
    "SQLITE_READONLY": READ_ONLY,
    "SQLITE_READONLY_DBMOVED": READ_ONLY,
    "SQLITE_READONLY_DIRECTORY": READ_ONLY,
    "SQLITE_CANTOPEN": NOT_OPENED,
    "53100": FULL,
    "25006": READ_ONLY,
}
"""By SQLite's names and by PostgreSQL's numbers."""
_ADVICE_BY_NUMBER = {errno.ENOSPC: FULL, errno.EDQUOT: FULL, errno.EROFS: READ_ONLY}
"""By those of the file system."""


def advice(error: BaseException) -> str | None:
    """Why nothing can be stored and what to do, without a full stop; None where that is not known."""
    if isinstance(error, OSError):
        return _ADVICE_BY_NUMBER.get(error.errno or 0)
    cause = error.orig if isinstance(error, DBAPIError) else error
    if isinstance(cause, sqlite3.Error):
        return _ADVICE_BY_CODE.get(getattr(cause, "sqlite_errorname", ""))
    return _ADVICE_BY_CODE.get(getattr(cause, "sqlstate", None) or "")


def told(error: BaseException) -> str:
    """What went wrong and, where it is known, what to do; one line, without a full stop."""
    if isinstance(error, DBAPIError):  # whose own text has the statement, its parameters and an address
        return advice(error) or f"the database failed: {error.orig}".splitlines()[0]
    return advice(error) or str(error) or type(error).__name__
