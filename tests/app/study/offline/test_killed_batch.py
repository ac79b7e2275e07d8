"""The batch of offline snaps, as a command, killed half-way."""

import shutil
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path

import pytest

from app.analysis.report.report import study_report
from app.analysis.report.report_files import write_report
from app.config import Settings
from app.storage.database import Database
from tests.app.waiting import LONGEST, wait_until
from tests.conftest import REPOSITORY
from tests.processes import command_line, descendants, environment, run_snap6d, workers_of

pytestmark = pytest.mark.slow  # a command with workers, killed and run again

STUDY = "try"
Run = Callable[..., str]


@pytest.fixture
def run(cluster: str) -> Run:
    """What a command about studies prints, in a process of its own on workers that are there already."""

    def printed(state: Path, *arguments: str) -> str:
        done = run_snap6d(state, "study", *arguments, **workers_of(cluster))
        assert done.returncode == 0, done.stderr
        return done.stdout

    return printed


@pytest.fixture
def simulated(run: Run, state_dir: Path) -> Path:
    """A state with a study of two simulated operators in one scene."""
    run(state_dir, "simulate", STUDY, "--operators", "1", "--scenes", "1")
    return state_dir


def report_by_command(run: Run, state: Path, out: Path) -> Mapping[str, bytes]:
    """All files of the report, as the command writes them."""
    printed = run(state, "report", STUDY, "--out", str(out))
    files = {path.name: path.read_bytes() for path in out.iterdir()}
    assert sorted(printed.splitlines()) == sorted(str(out / name) for name in files)
    return files


def report_by_call(state: Path, out: Path) -> Mapping[str, bytes]:
    """The same, in this process."""
    database = Database(Settings(state_dir=state).resolved_database_url)
    write_report(study_report(database, 1), out)
    database.close()
    return {path.name: path.read_bytes() for path in out.iterdir()}


def stored(state: Path) -> dict[int, float]:
    """Of all offline snaps, by id, how long they took."""
    with closing(sqlite3.connect(state / "snap6d.sqlite")) as connection:
        return dict(connection.execute("SELECT id, snap_seconds FROM offline_snaps").fetchall())


def kill_half_way(state: Path) -> None:
    """Start the batch, and end it as a crash or a power cut would, once something is stored."""
    process = subprocess.Popen(
        [sys.executable, "-m", "app.cli.commands", "study", "snap", STUDY],
        env=environment(state) | {"SNAP6D_WORKERS": "1"},
        cwd=REPOSITORY,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        wait_until(lambda: stored(state), "the first snaps to be stored")
        workers = descendants(process.pid)
    finally:
        process.kill()
    assert process.wait(LONGEST) == -signal.SIGKILL
    wait_until(lambda: not any(map(command_line, workers)), "the workers to go")


def test_killed_half_way_it_comes_to_the_same_bytes(simulated: Path, run: Run, tmp_path: Path) -> None:
    undisturbed = Path(shutil.copytree(simulated, tmp_path / "undisturbed"))
    printed = run(undisturbed, "snap", STUDY)
    kill_half_way(simulated)
    before, whole = stored(simulated), stored(undisturbed)
    assert 0 < len(before) < len(whole)
    assert f"{len(whole)} sampled poses" in printed and "0 failed" in printed
    assert f"{len(whole)} sampled poses" in run(simulated, "snap", STUDY)
    after = stored(simulated)
    assert len(after) == len(whole) and before.items() <= after.items()
    files = report_by_command(run, undisturbed, tmp_path / "report of the undisturbed")
    assert {Path(name).suffix for name in files} == {".svg", ".pdf", ".html", ".csv", ".parquet"}
    assert report_by_call(simulated, tmp_path / "report of the killed") == files
    assert b"simulated" in files["figure.svg"] and b"simulated" in files["report.html"]
