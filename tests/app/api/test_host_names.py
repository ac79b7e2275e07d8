"""Under which names the app answers, and whom it believes for whom they ask."""

import socket
from pathlib import Path
from types import SimpleNamespace

import httpx
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from app.access.throttle import FREE_ATTEMPTS
from app.api.host_names import host_name, own_names
from app.config import Settings
from app.main import create_services
from tests.app.conftest import settings_for
from tests.app.live import LiveServer, running_server
from tests.app.rest import sentence

FOREIGN = [
    "evil.example",
    "evil.example:8000",
    "localhost.evil.example",
    "127.0.0.1.evil.example",
    "",
    "[::1",
]


@pytest.mark.parametrize("host", FOREIGN)
@pytest.mark.parametrize("path", ["/api/health", "/sign-in", "/static/shared/dom.js", "/api/sign-in"])
def test_a_name_that_leads_here_by_somebody_elses_will_is_refused(
    live: LiveServer, host: str, path: str
) -> None:
    answer = live.stranger().get(path, headers={"host": host})
    assert "is not known here as" in sentence(answer, 421)


def test_a_websocket_under_such_a_name_is_refused(live: LiveServer) -> None:
    origin = Origin("http://evil.example")
    with (
        socket.create_connection(("127.0.0.1", live.port)) as opened,
        pytest.raises(InvalidStatus) as refused,
    ):
        connect("ws://evil.example/view/1/", sock=opened, origin=origin, proxy=None)
    assert refused.value.response.status_code == 403


@pytest.mark.parametrize("name", ["localhost", "LOCALHOST", "localhost.", "127.0.0.1", "[::1]", "192.0.2.7"])
@pytest.mark.parametrize("port", ["", ":8000"])
def test_own_names_and_addresses_are_answered(live: LiveServer, name: str, port: str) -> None:
    assert live.stranger().get("/sign-in", headers={"host": name + port}).status_code == 200


def test_the_machines_and_the_settings_names_are_own() -> None:
    names = own_names(Settings(host="snap.lab", host_names="Pose.lab, label.lab"))
    assert {"snap.lab", "pose.lab", "label.lab", "localhost", socket.gethostname().lower()} <= names
    assert "" not in names


@pytest.mark.parametrize(
    ("host", "expected"),
    [("A.b:80", "a.b"), ("[::1]:80", "::1"), ("a.b.", "a.b"), ("", ""), ("user@a.b", "a.b")],
)
def test_a_name_is_told_from_its_port(host: str, expected: str) -> None:
    assert host_name(host) == expected


@pytest.fixture
def still(monkeypatch: pytest.MonkeyPatch) -> None:
    """No time passes for who has to wait."""
    monkeypatch.setattr("app.access.throttle.time", SimpleNamespace(time=lambda: 1000.0))


def settings_with(state: Path, cluster: str, **changes: str) -> Settings:
    return settings_for(state, cluster).model_copy(update=changes)


def guesses(client: httpx.Client) -> list[int]:
    """What one guess more than is free is answered, each under another forwarded address."""
    return [
        client.post(
            "/api/sign-in",
            json={"name": "ann", "password": "wrong"},
            headers={"x-forwarded-for": f"192.0.2.{i}"},
        ).status_code
        for i in range(FREE_ATTEMPTS + 1)
    ]


def test_nobody_is_believed_whom_they_ask_for(live: LiveServer, still: None) -> None:
    assert guesses(live.stranger()) == [401] * FREE_ATTEMPTS + [429]


def test_a_trusted_proxy_is_believed(state_dir: Path, cluster: str, still: None) -> None:
    settings = settings_with(state_dir, cluster, trusted_proxies="127.0.0.1")
    with running_server(create_services(settings)) as server:
        assert guesses(server.stranger()) == [401] * (FREE_ATTEMPTS + 1)


def test_behind_a_public_address_the_proxy_may_name_the_app_as_it_likes(
    state_dir: Path, cluster: str
) -> None:
    """The Host header is asked for nothing then: who is a foreign page is told by the public address."""
    settings = settings_with(state_dir, cluster, public_url="https://snap.example")
    with running_server(create_services(settings)) as server:
        client = server.stranger()
        client.headers["host"] = "upstream"
        assert client.get("/sign-in").status_code == 200
        foreign = client.post("/api/sign-in/link", json={"token": "x"}, headers={"origin": "http://upstream"})
        assert "foreign page" in sentence(foreign, 403)
