"""A view is on no port of the machine: strangers, pages of other sites among them, get nothing to talk to."""

import os
import socket
import subprocess
import sys
import threading
from pathlib import Path

import httpx
import psutil
import pytest
from websockets.exceptions import WebSocketException

from app.views3d.view_socket import LONGEST_PATH, ViewSocket
from tests.app.labeling.viser_client import ViserClient
from tests.app.live import LiveServer
from tests.app.rest import begin

CONNECT = """
import os, socket, sys
os.setuid(int(sys.argv[2]))
socket.socket(socket.AF_UNIX).connect(sys.argv[1])
"""
SOMEBODY_ELSE = 65534


def ports_that_show_a_scene() -> list[int]:
    """Of this process, those on which a stranger's WebSocket gets a scene or an HTTP request viser's page."""
    listening = [c.laddr.port for c in psutil.Process().net_connections("tcp") if c.status == "LISTEN"]
    return [port for port in listening if answers_http(port) or answers_websocket(port)]


def answers_http(port: int) -> bool:
    try:
        return "viser" in httpx.get(f"http://127.0.0.1:{port}/", timeout=5).text.lower()
    except httpx.HTTPError:
        return False


def answers_websocket(port: int) -> bool:
    try:
        with ViserClient(f"ws://127.0.0.1:{port}/", origin="http://evil.example") as client:
            return client.node("MeshMessage", "/object/mesh") is not None
    except (OSError, WebSocketException, EOFError):
        return False


def connecting_as(account: int, path: Path) -> str:
    """What a program of an account says when it connects; nothing where it may."""
    command = [sys.executable, "-c", CONNECT, str(path), str(account)]
    return subprocess.run(command, check=False, capture_output=True, text=True).stderr


@pytest.mark.parametrize("of_replay", [False, True])
def test_no_port_of_the_server_shows_a_scene_to_a_stranger(live: LiveServer, of_replay: bool):
    ann = live.person(f"ann with a view, {of_replay}")
    registration = begin(ann)
    if of_replay:
        ann.post(f"/api/registrations/{registration['id']}/replay")
        page = ann.get(f"/view/replay/{registration['id']}/")
    else:
        page = ann.get(registration["view_url"])
    assert "viser" in page.text.lower()  # there is a view, for its owner
    assert ports_that_show_a_scene() == []


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can act as another account")
def test_another_account_of_the_machine_cannot_connect():
    place = ViewSocket()
    server = place.server()
    assert connecting_as(os.geteuid(), place.path) == ""
    assert "Permission denied" in connecting_as(SOMEBODY_ELSE, place.path)
    server.stop()
    place.close()


def test_the_folder_is_private_and_goes_with_the_view():
    place = ViewSocket()
    assert place.path.parent.stat().st_mode & 0o777 == 0o700
    server = place.server()
    assert place.path.is_socket()
    server.stop()
    place.close()
    assert not place.path.parent.exists()


def test_views_that_are_made_at_once_each_get_their_own_file():
    places = [ViewSocket() for _ in range(8)]
    servers = []
    threads = [
        threading.Thread(target=lambda place=place: servers.append(place.server())) for place in places
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for place in places:
        with socket.socket(socket.AF_UNIX) as one:
            one.connect(str(place.path))
    for server in servers:
        server.stop()
    for place in places:
        place.close()


def test_a_folder_with_too_long_a_name_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    deep = tmp_path / ("x" * LONGEST_PATH)
    deep.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(deep))
    with pytest.raises(OSError, match="set TMPDIR to a shorter folder"):
        ViewSocket()
    assert list(deep.iterdir()) == []
