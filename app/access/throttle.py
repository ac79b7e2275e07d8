"""Makes guessing passwords slow, and costs nobody else anything: neither their sign-in nor their writes."""

import hashlib
import ipaddress
import sqlite3
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

FREE_ATTEMPTS = 5
"""Wrong passwords for one name from one address before waiting begins; it doubles with each further one."""
FREE_ATTEMPTS_OF_AN_ADDRESS = 50
"""The same for all names together: an office may share an address."""
LONGEST_WAIT_SECONDS = 300.0
SECONDS_UNTIL_FORGOTTEN = 24 * 3600.0


@dataclass(frozen=True)
class _Counted:
    """Attempts that are counted together."""

    key: str
    free: int


class Throttle:
    """Counts attempts by name and address together, so that nobody locks anybody out from elsewhere.

    An attempt counts as failed before it is looked at: of many at once none slips through. The counts outlast
    a restart, in a file of their own: a stranger who guesses keeps no drag waiting for the database.

    Args:
        file: Where the counts are kept; in memory where it is None.
    """

    def __init__(self, file: Path | None = None) -> None:
        self._file = file
        self._opened: sqlite3.Connection | None = None
        self._lock = threading.Lock()

    def attempt(self, name: str, address: str) -> float:
        """Count an attempt to sign in; returns the seconds it has to wait and does not count, or 0."""
        now = time.time()
        with self._transaction() as counts:
            counts.execute("DELETE FROM attempts WHERE last < ?", (now - SECONDS_UNTIL_FORGOTTEN,))
            # of a clock that was set back: nobody waits until it has caught up
            counts.execute("UPDATE attempts SET last = ? WHERE last > ?", (now, now))
            wait = max(_wait(counts, counted, now) for counted in _counted(name, address))
            if wait <= 0:
                for counted in _counted(name, address):
                    counts.execute(
                        "INSERT INTO attempts VALUES (?, 1, ?)"
                        " ON CONFLICT (key) DO UPDATE SET count = count + 1, last = excluded.last",
                        (counted.key, now),
                    )
        return max(0.0, wait)

    def succeeded(self, name: str, address: str) -> None:
        """Forget the attempts of a name from an address, and charge the address nothing for the last one."""
        of_name, of_address = _counted(name, address)
        with self._transaction() as counts:
            counts.execute("DELETE FROM attempts WHERE key = ?", (of_name.key,))
            counts.execute("UPDATE attempts SET count = count - 1 WHERE key = ?", (of_address.key,))

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            if self._opened is not None:
                self._opened.close()
                self._opened = None

    @contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        """The counts, to be changed by nobody else until the block ends."""
        with self._lock:
            if self._opened is None:
                self._opened = _open(self._file)
            with self._opened:
                self._opened.execute("BEGIN IMMEDIATE")
                yield self._opened


def _open(file: Path | None) -> sqlite3.Connection:
    counts = sqlite3.connect(file or ":memory:", check_same_thread=False, isolation_level=None)
    for statement in (
        "PRAGMA journal_mode=WAL",
        "PRAGMA synchronous=NORMAL",
        "CREATE TABLE IF NOT EXISTS attempts (key TEXT PRIMARY KEY, count INTEGER, last REAL)",
    ):
        counts.execute(statement)
    return counts


def _wait(counts: sqlite3.Connection, counted: _Counted, now: float) -> float:
    """Seconds until the next attempt; none where it is not positive."""
    row = counts.execute("SELECT count, last FROM attempts WHERE key = ?", (counted.key,)).fetchone()
    count, last = row or (0, 0.0)
    if count < counted.free:
        return 0.0
    doublings = min(count - counted.free, 32)
    return min(LONGEST_WAIT_SECONDS, 2.0**doublings) - (now - last)


def _counted(name: str, address: str) -> tuple[_Counted, _Counted]:
    """Of a name from an address, and of the address; hashed, for people type passwords for names."""
    place = _place(address)
    return (
        _Counted(_hashed(f"{place}\0{name}"), FREE_ATTEMPTS),
        _Counted(_hashed(place), FREE_ATTEMPTS_OF_AN_ADDRESS),
    )


def _place(address: str) -> str:
    """What one caller cannot easily leave: of IPv6 a network, since everybody has one."""
    try:
        parsed = ipaddress.ip_address(address)
    except ValueError:
        return address
    if isinstance(parsed, ipaddress.IPv6Address):
        if parsed.ipv4_mapped is not None:
            return str(parsed.ipv4_mapped)
        return str(ipaddress.ip_network((parsed, 64), strict=False))
    return str(parsed)


def _hashed(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
