"""Of two servers on one state folder the second says so and stops; the first and its work go on."""

import errno
import fcntl
import json
import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import httpx
import pytest

from app.config import Settings
from app.serving.state_lock import StateInUseError, held, running_server
from app.storage.database import Database
from app.storage.tables import Export, User
from tests.app.waiting import LONGEST
from tests.processes import failure, run_snap6d, serving, workers_of

pytestmark = pytest.mark.slow  # servers in processes of their own

HOLDER = """
import signal, sys
from pathlib import Path
from app.serving.state_lock import held
with held(Path(sys.argv[1]), "127.0.0.1", 8123):
    print("held", flush=True)
    signal.pause()
"""


def test_the_second_is_told_who_the_first_is(tmp_path: Path) -> None:
    first, second = held(tmp_path, "127.0.0.1", 8123), held(tmp_path, "127.0.0.1", 8124)
    with first, pytest.raises(StateInUseError) as refused, second:
        pass
    said = str(refused.value)
    assert f"process {os.getpid()} on {socket.gethostname()} since 20" in said and "port 8123;" in said
    with held(tmp_path, "127.0.0.1", 8124):
        pass


def test_who_holds_it_can_be_asked(tmp_path: Path) -> None:
    assert running_server(tmp_path) is None and running_server(tmp_path / "nothing") is None
    with held(tmp_path, "0.0.0.0", 8123):
        found = running_server(tmp_path)
        assert found is not None
        assert (found.pid, found.host, found.port) == (os.getpid(), "0.0.0.0", 8123)
    assert running_server(tmp_path) is None
    assert json.loads((tmp_path / "server.lock").read_text())["port"] == 8123  # which is no lock by itself


def test_a_server_that_was_killed_holds_nothing(tmp_path: Path) -> None:
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(tmp_path)], stdout=subprocess.PIPE, text=True
    )
    assert holder.stdout is not None and holder.stdout.readline() == "held\n"
    with pytest.raises(StateInUseError, match=f"process {holder.pid} "), held(tmp_path, "127.0.0.1", 1):
        pass
    holder.send_signal(signal.SIGKILL)
    holder.wait(LONGEST)
    holder.stdout.close()
    with held(tmp_path, "127.0.0.1", 1):
        pass


def test_a_file_system_without_locks_is_warned_of(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def refuse(_file: object, _operation: int) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", refuse)
    with held(tmp_path, "127.0.0.1", 8123):
        assert running_server(tmp_path) is None
    assert "cannot be locked" in caplog.text


def test_a_second_server_stops_and_an_export_under_way_goes_on(state_dir: Path, cluster: str) -> None:
    database = Database(Settings(state_dir=state_dir).resolved_database_url)
    with serving(state_dir, **workers_of(cluster)) as server:
        with database.write() as session:
            session.add(User(name="ann", role="admin"))
            session.flush()
            session.add(Export(dataset_id=1, format="bop", user_id=1, state="running"))
        message = failure(run_snap6d(state_dir, "serve", "--port", "0", "--prepare"))
        assert f"is in use by another Snap6D, process {server.process.pid} on" in message
        with database.read() as session:
            assert session.get_one(Export, 1).state == "running"
        answer = httpx.get(f"{server.url.replace('localhost', '127.0.0.1')}/sign-in", timeout=LONGEST)
        assert answer.status_code == 200
        # and links lead to the port that the server has, whatever the settings say
        for arguments in (("add", "bob"), ("link", "bob")):
            assert f"{server.url}/sign-in#" in server.command("user", *arguments)
    database.close()
