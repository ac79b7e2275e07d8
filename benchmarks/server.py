"""A real `snap6d serve` in a process of its own, with a state directory of its own."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx
import psutil

from app.access.auth import Auth
from app.config import Settings
from app.datasets.importing import import_dataset
from app.storage.database import Database
from app.storage.files import FileStore
from app.storage.roles import Role
from benchmarks import PROJECT

SERVE = (sys.executable, "-m", "app.cli.commands", "serve")
SECONDS_TO_START = 180.0
SECONDS_TO_STOP = 30.0
SECONDS_BETWEEN_TRIES = 0.02


class ServerError(Exception):
    """The server did not start or did not stop; the message holds the end of what it printed."""


@dataclass(frozen=True)
class RunningServer:
    """A server that answers."""

    process: psutil.Popen
    url: str
    state_dir: Path
    seconds_to_ready: float
    """From the start of the process to the answer 200 of /api/health."""

    def worker_processes(self) -> list[psutil.Process]:
        """The processes that compute snaps."""
        children = self.process.children(recursive=True)
        return [child for child in children if "spawn_main" in " ".join(child.cmdline())]


def settings_of(state_dir: Path) -> Settings:
    """What a server with this state directory works with."""
    return Settings(state_dir=state_dir)


@contextmanager
def database_of(state_dir: Path) -> Iterator[Database]:
    """The database of a state directory, which a server may use at the same time."""
    database = Database(settings_of(state_dir).resolved_database_url)
    try:
        yield database
    finally:
        database.close()


def prepare_state(state_dir: Path, datasets: Sequence[Path]) -> None:
    """Make a state directory with these BOP datasets imported."""
    state_dir.mkdir(parents=True)
    with database_of(state_dir) as database:
        database.migrate()
        for dataset in datasets:
            import_dataset(database, FileStore(settings_of(state_dir).files_dir), dataset)


def sign_in_secrets(state_dir: Path, count: int) -> list[str]:
    """Secrets of one-time links that sign in as many operators, who are made where they are not there."""
    with database_of(state_dir) as database:
        auth = Auth(database)
        users = [auth.ensure_user(f"operator {number}", Role.OPERATOR) for number in range(1, count + 1)]
        return [auth.create_link(user.id) for user in users]


@contextmanager
def server_on(
    folder: Path, datasets: Sequence[Path], command: Sequence[str] = SERVE
) -> Iterator[RunningServer]:
    """A running server in this folder that has imported these BOP datasets, and nothing else."""
    state = folder / "state"
    prepare_state(state, datasets)
    with running_server(state, command=command) as server:
        yield server


@contextmanager
def running_server(
    state_dir: Path, *arguments: str, command: Sequence[str] = SERVE
) -> Iterator[RunningServer]:
    """Start a server on a free port, wait until it is ready, and stop it at the end.

    Raises:
        ServerError: where it does not become ready or does not stop.
    """
    port = _free_port()
    output = state_dir.with_suffix(".log")
    with output.open("wb") as sink:
        began = time.perf_counter()
        process = psutil.Popen(
            [*command, "--port", str(port), *arguments],
            cwd=PROJECT,
            env={**os.environ, "SNAP6D_STATE_DIR": str(state_dir), "PYTHONUNBUFFERED": "1"},
            stdin=subprocess.DEVNULL,
            stdout=sink,
            stderr=subprocess.STDOUT,
        )
    try:
        url = f"http://127.0.0.1:{port}"
        _wait_until_ready(process, url, output)
        yield RunningServer(process, url, state_dir, time.perf_counter() - began)
    finally:
        _stop(process, output)


def _wait_until_ready(process: psutil.Popen, url: str, output: Path) -> None:
    deadline = time.perf_counter() + SECONDS_TO_START
    while time.perf_counter() < deadline:
        if process.poll() is not None:
            raise ServerError(f"the server ended:\n{_tail(output)}")
        try:
            if httpx.get(f"{url}/api/health", timeout=SECONDS_TO_START).status_code == 200:
                return
        except httpx.TransportError:
            pass  # it does not listen yet
        time.sleep(SECONDS_BETWEEN_TRIES)
    raise ServerError(f"the server was not ready after {SECONDS_TO_START:.0f} s:\n{_tail(output)}")


def _stop(process: psutil.Popen, output: Path) -> None:
    family = process.children(recursive=True) if process.is_running() else []
    if process.poll() is None:
        process.send_signal(signal.SIGTERM)
    try:
        process.wait(SECONDS_TO_STOP)
    except psutil.TimeoutExpired as error:
        process.kill()
        process.wait()
        raise ServerError(f"the server did not stop:\n{_tail(output)}") from error
    finally:
        _, alive = psutil.wait_procs(family, timeout=5)
        for left in alive:
            left.kill()


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def _tail(output: Path) -> str:
    return "\n".join(output.read_text(errors="replace").splitlines()[-30:])
