"""Starting and stopping the server on its one port."""

import signal
from pathlib import Path

import httpx
import pytest

from app.config import Settings
from app.server import prepare_state
from app.storage.database import Database
from app.storage.tables import Dataset, Task
from tests.app.waiting import LONGEST, wait_until
from tests.processes import command_line, descendants, failure, run_snap6d, serving

pytestmark = pytest.mark.slow  # servers in processes of their own


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
