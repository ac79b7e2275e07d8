"""Real `snap6d` processes."""

import contextlib
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import dask
import httpx
import psutil

from app.access.auth import Auth
from app.config import Settings
from app.storage.database import Database
from app.storage.roles import Role
from tests.app.waiting import LONGEST
from tests.conftest import REPOSITORY

Command = Callable[..., subprocess.CompletedProcess[str]]
"""Runs `snap6d` on a state directory with arguments, and with settings as keywords."""


def environment(state_dir: Path) -> dict[str, str]:
    """What a `snap6d` process is started with: nothing of this machine's own settings."""
    own = {name: value for name, value in os.environ.items() if not name.startswith("SNAP6D_")}
    return {**own, "SNAP6D_STATE_DIR": str(state_dir), "PYTHONUNBUFFERED": "1"}


def run_snap6d(
    state_dir: Path, *arguments: str, typed: str = "", **variables: str
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end."""
    return subprocess.run(
        [sys.executable, "-m", "app.cli.commands", *arguments],
        env=environment(state_dir) | variables,
        cwd=REPOSITORY,
        input=typed,
        capture_output=True,
        text=True,
        timeout=LONGEST,
        check=False,
    )


def failure(done: subprocess.CompletedProcess[str]) -> str:
    """The one sentence with which a command failed."""
    assert done.returncode == 1, done
    assert done.stderr.startswith("snap6d: ") and done.stderr.count("\n") == 1, done.stderr
    return done.stderr.removeprefix("snap6d: ").strip()


@dataclass(frozen=True)
class Server:
    """A running `snap6d serve`."""

    process: subprocess.Popen[str]
    state_dir: Path
    url: str
    secret: str
    """Of the sign-in link."""
    printed: str

    @property
    def host(self) -> str:
        """As in the Host header."""
        return self.url.removeprefix("http://")

    @property
    def sign_in_link(self) -> str:
        """The one-time link of the local administrator."""
        return f"{self.url}/sign-in#{self.secret}"

    def new_link(self, name: str, role: str = "operator") -> str:
        """A one-time sign-in link of a new user, as `snap6d user add` prints it, without a process for it."""
        database = Database(Settings(state_dir=self.state_dir).resolved_database_url)
        with contextlib.closing(database), contextlib.closing(Auth(database)) as auth:
            user = auth.create_user(name, Role(role))
            return f"{self.url}/sign-in#{auth.create_link(user.id)}"

    def command(self, *arguments: str) -> str:
        """What a `snap6d` command on the same state prints."""
        done = run_snap6d(self.state_dir, *arguments)
        assert done.returncode == 0, done.stderr
        return done.stdout

    def stop(self) -> int:
        """Ask it to end, wait until it has, and return its exit code."""
        self.process.terminate()
        return self._wait()

    def kill(self) -> None:
        """End it at once, with everything that it started."""
        for process in descendants(self.process.pid):
            with contextlib.suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        self.process.kill()
        self._wait()

    def _wait(self) -> int:
        assert self.process.stdout is not None
        self.process.stdout.close()
        return self.process.wait(LONGEST)


def workers_of(cluster: str) -> dict[str, str]:
    """The variables by which a process uses the workers of the fixture `cluster`: its own take seconds."""
    tls = dask.config.get("distributed.comm.tls")
    return {
        "SNAP6D_SCHEDULER_ADDRESS": cluster,
        "DASK_DISTRIBUTED__COMM__TLS__CA_FILE": tls["ca-file"],
        "DASK_DISTRIBUTED__COMM__TLS__CLIENT__KEY": tls["client"]["key"],
        "DASK_DISTRIBUTED__COMM__TLS__CLIENT__CERT": tls["client"]["cert"],
    }


def start_server(state_dir: Path, *arguments: str, **variables: str) -> Server:
    """Start a server on a free port and wait until it tells its sign-in link."""
    process = subprocess.Popen(
        [sys.executable, "-m", "app.cli.commands", "serve", "--port", "0", *arguments],
        env=environment(state_dir) | variables,
        cwd=REPOSITORY,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    return started(process, state_dir)


def started(process: subprocess.Popen[str], state_dir: Path) -> Server:
    """Wait until a server tells its sign-in link."""
    assert process.stdout is not None
    printed = ""
    for line in process.stdout:
        printed += line
        if found := re.search(r"(http://\S+)/sign-in#(\S+)", line):
            return Server(process, state_dir, found[1], found[2], printed)
    process.wait(LONGEST)
    raise AssertionError(f"the server did not start:\n{printed}")


@contextmanager
def serving(state_dir: Path, *arguments: str, **variables: str) -> Iterator[Server]:
    """A server on a free port; however the block ends, nothing of it is left."""
    server = start_server(state_dir, *arguments, **variables)
    try:
        yield server
    finally:
        server.kill()


@contextmanager
def signed_in(state_dir: Path, *arguments: str, **variables: str) -> Iterator[tuple[Server, httpx.Client]]:
    """A server, and its administrator."""
    with (
        serving(state_dir, *arguments, **variables) as server,
        httpx.Client(base_url=server.url, timeout=LONGEST) as http,
    ):
        assert http.post("/api/sign-in/link", json={"token": server.secret}).status_code == 204
        yield server, http


def descendants(pid: int) -> set[int]:
    """Processes that a process started, and those started in turn; none where it is gone."""
    try:
        return {process.pid for process in psutil.Process(pid).children(recursive=True)}
    except psutil.NoSuchProcess:
        return set()


def command_line(pid: int) -> Sequence[str]:
    """What a process was started with; empty where it has ended, even if nobody has asked how."""
    try:
        return psutil.Process(pid).cmdline()
    except psutil.NoSuchProcess:
        return []
