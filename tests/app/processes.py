"""Real `snap6d` processes."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from app.config import PROJECT
from tests.app.waiting import LONGEST


def environment(state_dir: Path) -> dict[str, str]:
    """What a `snap6d` process is started with: nothing of this machine's own settings."""
    own = {name: value for name, value in os.environ.items() if not name.startswith("SNAP6D_")}
    return {**own, "SNAP6D_STATE_DIR": str(state_dir), "PYTHONUNBUFFERED": "1"}


def run_snap6d(
    state_dir: Path, *arguments: str, typed: str = "", **variables: str
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end."""
    return subprocess.run(
        [sys.executable, "-m", "app.cli", *arguments],
        env=environment(state_dir) | variables,
        cwd=PROJECT,
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
class ServerProcess:
    """A running `snap6d serve`."""

    process: subprocess.Popen[str]
    url: str
    secret: str
    """Of the sign-in link."""
    printed: str

    @property
    def host(self) -> str:
        """As in the Host header."""
        return self.url.removeprefix("http://")


@contextmanager
def serving(state_dir: Path, *arguments: str) -> Iterator[ServerProcess]:
    """A server on a free port, ready; however the block ends, nothing of it is left."""
    process = subprocess.Popen(
        [sys.executable, "-m", "app.cli", "serve", "--port", "0", "--workers", "1", *arguments],
        env=environment(state_dir),
        cwd=PROJECT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout is not None
    try:
        printed = ""
        for line in process.stdout:
            printed += line
            if found := re.search(r"(http://\S+)/sign-in#(\S+)", line):
                yield ServerProcess(process, found[1], found[2], printed)
                break
        else:
            raise AssertionError(f"the server did not start:\n{printed}")
    finally:
        process.kill()
        process.stdout.close()
        process.wait(LONGEST)


def children_of(pid: int) -> list[int]:
    """The processes that a process started."""
    found = []
    for task in Path(f"/proc/{pid}/task").iterdir():
        found += [int(child) for child in (task / "children").read_text().split()]
    return found


def command_line(pid: int) -> Sequence[str]:
    """What a process was started with; empty where it is gone."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_text().split("\0")
    except (FileNotFoundError, ProcessLookupError):
        return []
