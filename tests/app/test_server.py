"""Starting and stopping the server on its one port."""

import signal
import socket
from pathlib import Path

import httpx
import pytest

from app.config import Settings
from app.database import Database
from app.server import prepare_state, sign_in_link
from app.tables import Dataset, Task
from tests.app.waiting import LONGEST, wait_until
from tests.processes import command_line, descendants, failure, run_snap6d, serving


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({}, "http://localhost:8123/sign-in#S"),
        ({"host": "0.0.0.0"}, "http://localhost:8123/sign-in#S"),
        ({"host": "192.0.2.7"}, "http://192.0.2.7:8123/sign-in#S"),
        ({"public_url": "https://snap.example/"}, "https://snap.example/sign-in#S"),
        ({"host": "2001:db8::7"}, "http://[2001:db8::7]:8123/sign-in#S"),
    ],
)
def test_the_link_can_be_opened_where_the_browser_is(settings, expected):
    assert sign_in_link(Settings(**settings), 8123, "S") == expected


def test_a_port_in_use_is_said_before_anything_is_started(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        message = failure(run_snap6d(tmp_path / "state", "serve", "--port", str(port), "--prepare"))
    assert message.startswith(f"port {port} on 127.0.0.1 cannot be used (Address already in use); stop what")
    assert "--port" in message
    assert not (tmp_path / "state").exists()


def test_an_address_of_another_machine_is_said(tmp_path):
    message = failure(run_snap6d(tmp_path, "serve", "--host", "192.0.2.7", "--port", "0"))
    assert message.startswith("port 0 on 192.0.2.7 cannot be used")


def test_a_scheduler_that_does_not_answer_is_said(state_dir):
    message = failure(
        run_snap6d(
            state_dir,
            *("serve", "--port", "0", "--scheduler-address", "tcp://127.0.0.1:1"),
            DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT="1s",
        )
    )
    assert message.startswith("the workers cannot be reached: ")


def test_preparing_makes_the_database_and_the_demo_scenes_once(tmp_path):
    settings = Settings(state_dir=tmp_path)
    said: list[str] = []
    prepare_state(settings, said.append)
    assert len(said) == 1 and "demo scenes" in said[0]
    prepare_state(settings, said.append)
    assert len(said) == 1
    database = Database(settings.resolved_database_url)
    with database.read() as session:
        assert session.query(Dataset).one().name == "demo"
        assert session.query(Task).count() >= 9
    database.close()


def ready(client: httpx.Client) -> dict | None:
    answer = client.get("/api/health")
    return answer.json() if answer.status_code == 200 else None


def test_it_serves_until_it_is_asked_to_stop(state_dir: Path):
    with serving(state_dir, "--workers", "1") as server:
        assert "works once" in server.printed
        with httpx.Client(base_url=server.url.replace("localhost", "127.0.0.1"), timeout=LONGEST) as client:
            health = wait_until(lambda: ready(client), "workers")
            assert health["workers"] == 1
            assert client.post("/api/sign-in/link", json={"token": server.secret}).status_code == 204
            assert client.get("/api/me").json()["role"] == "admin"
            children = descendants(server.process.pid)
            assert children
            with client.stream("GET", "/api/health"):
                server.process.send_signal(signal.SIGTERM)
        assert server.process.wait(LONGEST) in {0, -signal.SIGTERM}
        wait_until(lambda: not any(map(command_line, children)), "the workers to go")
