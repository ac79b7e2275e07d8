"""Health tells what is there and what is missing, to everybody."""

import shutil
from pathlib import Path

import httpx
from distributed import LocalCluster

from app import __version__
from app.main import create_services
from tests.app.conftest import settings_for
from tests.app.live import LiveServer, running_server
from tests.app.waiting import wait_until


def healthy(client: httpx.Client) -> httpx.Response | None:
    answer = client.get("/api/health")
    return answer if answer.status_code == 200 else None


def test_it_is_ready_with_database_and_workers(live: LiveServer) -> None:
    answer = wait_until(lambda: healthy(live.stranger()), "the workers")
    assert answer.json() == {
        "status": "ready",
        "version": __version__,
        "database": True,
        "workers": 2,
        "waiting": 0,
    }


def test_it_waits_for_workers(state_dir: Path) -> None:
    with (
        LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address="127.0.0.1:0") as empty,
        running_server(create_services(settings_for(state_dir, empty.scheduler_address))) as server,
    ):
        answer = server.stranger().get("/api/health")
        assert answer.status_code == 503
        assert answer.json() == {
            "status": "waiting for workers",
            "version": __version__,
            "database": True,
            "workers": 0,
            "waiting": 0,
        }


def test_it_waits_for_the_database_and_finds_it_again(own_live: LiveServer) -> None:
    client = own_live.stranger()
    wait_until(lambda: healthy(client), "the workers")
    state_dir = own_live.services.settings.state_dir
    own_live.services.database.engine.dispose()
    away = state_dir.rename(state_dir.with_name("away"))
    answer = client.get("/api/health")
    assert answer.status_code == 503
    assert answer.json()["status"] == "waiting for database"
    assert not answer.json()["database"]
    shutil.rmtree(state_dir, ignore_errors=True)
    away.rename(state_dir)
    assert healthy(client) is not None
