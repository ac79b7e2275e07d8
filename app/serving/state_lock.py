"""One server a state folder: two would fail each other's exports and drive each other's sessions apart."""

import errno
import fcntl
import json
import logging
import os
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import IO

logger = logging.getLogger(__name__)

CANNOT_TELL = frozenset({errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS})
"""Of file systems without locks, such as some NFS."""
SECONDS_OF_A_GLANCE = 0.5
"""That looking who holds the lock keeps it from a server, at most."""


class StateFolderError(Exception):
    """The state folder cannot be written to; the message says why and what to do."""


class StateInUseError(Exception):
    """Another server is at work on the state folder; the message says which."""


@dataclass(frozen=True)
class RunningServer:
    """The server that holds a state folder."""

    pid: int
    machine: str
    since: str
    """As in ISO 8601, to the second."""
    host: str
    """Address that it listens on."""
    port: int


@contextmanager
def held(state_dir: Path, host: str, port: int) -> Iterator[None]:
    """Keep a state folder to this server, which listens on `host` and `port`, until the block ends.

    However the process ends, the folder is free afterwards. The lock reaches over NFS, where it has locks.

    Raises:
        StateFolderError: where nothing can be written there.
        StateInUseError: where another server holds it.
    """
    with _opened(state_dir) as file:
        _lock(file, state_dir)
        now = datetime.now(UTC).isoformat(timespec="seconds")
        me = RunningServer(os.getpid(), socket.gethostname(), now, host, port)
        with _told_of(state_dir):
            os.ftruncate(file.fileno(), 0)
            os.write(file.fileno(), json.dumps(asdict(me)).encode())  # at once: closing could fail again
        yield


def running_server(state_dir: Path) -> RunningServer | None:
    """The server that holds a state folder now; None where none does, or the file system cannot tell."""
    try:
        with _lock_file(state_dir).open() as file:
            try:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                return _told(file)
    except OSError:
        pass
    return None


def _opened(state_dir: Path) -> IO[str]:
    with _told_of(state_dir):
        state_dir.mkdir(parents=True, exist_ok=True)
        return _lock_file(state_dir).open("a+")


@contextmanager
def _told_of(state_dir: Path) -> Iterator[None]:
    """Say of what the file system refuses which folder it is about."""
    try:
        yield
    except OSError as error:
        raise StateFolderError(
            f"nothing can be written to the state folder {state_dir} ({error.strerror}); mend that, or choose"
            " another --state-dir"
        ) from error


def _lock(file: IO[str], state_dir: Path) -> None:
    deadline = time.monotonic() + SECONDS_OF_A_GLANCE
    while True:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except BlockingIOError:
            if time.monotonic() > deadline:
                raise StateInUseError(_in_use(_told(file), state_dir)) from None
        except OSError as error:
            if error.errno not in CANNOT_TELL:
                raise
            logger.warning("%s cannot be locked: see to it that no second server works on it", state_dir)
            return
        time.sleep(0.05)


def _told(file: IO[str]) -> RunningServer | None:
    """What the file says of its holder; None while that is being written."""
    file.seek(0)
    try:
        return RunningServer(**json.load(file))
    except (ValueError, TypeError):
        return None


def _in_use(other: RunningServer | None, state_dir: Path) -> str:
    who = (
        f"another Snap6D, process {other.pid} on {other.machine} since {other.since}, port {other.port}"
        if other
        else "another Snap6D"
    )
    return f"the state folder {state_dir} is in use by {who}; stop that one, or choose another --state-dir"


def _lock_file(state_dir: Path) -> Path:
    return state_dir / "server.lock"
