"""Connections that do not come to the point are closed; those at work are not."""

import socket
from collections.abc import Iterator

import pytest

from app.serving import connections
from tests.app.live import LiveServer
from tests.app.rest import begin
from tests.app.waiting import LONGEST, wait_until

REQUEST = b"GET /api/health HTTP/1.1\r\nHost: 127.0.0.1\r\n"


@pytest.fixture
def opened(live: LiveServer, monkeypatch: pytest.MonkeyPatch) -> Iterator[socket.socket]:
    monkeypatch.setattr(connections, "SECONDS_FOR_HEADERS", 0.3)
    with socket.create_connection(("127.0.0.1", live.port), timeout=LONGEST) as connection:
        yield connection


def test_a_connection_that_says_nothing_is_closed(opened: socket.socket) -> None:
    assert opened.recv(1) == b""


def test_headers_that_never_end_are_cut_off(opened: socket.socket) -> None:
    opened.sendall(REQUEST)
    sent = 0

    def is_closed() -> bool:
        nonlocal sent
        sent += 1
        try:
            opened.sendall(f"X-{sent}: x\r\n".encode())  # a line for ever, as a slow attack does
        except OSError:
            return True
        return False

    wait_until(is_closed, "the connection to be closed")


def test_a_second_request_that_never_ends_is_cut_off(opened: socket.socket) -> None:
    opened.sendall(REQUEST + b"\r\n")
    assert opened.recv(65536).startswith(b"HTTP/1.1 ")
    opened.sendall(REQUEST)
    while opened.recv(65536):
        pass


def test_a_refused_body_that_trickles_on_is_cut_off(opened: socket.socket) -> None:
    upload = b"POST /api/datasets HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 4000000\r\n\r\n"
    opened.sendall(upload)
    assert opened.recv(65536).startswith(b"HTTP/1.1 401 ")

    def is_closed() -> bool:
        try:
            opened.sendall(b"x")
        except OSError:
            return True
        return False

    wait_until(is_closed, "the connection to be closed")


def test_an_answer_that_takes_long_is_not_cut_off(live: LiveServer, opened: socket.socket) -> None:
    """The stream of a registration goes on as long as its page is open."""
    client = live.script("who waits")
    registration = begin(client)
    request = (
        f"GET /api/registrations/{registration['id']}/stream HTTP/1.1\r\nHost: 127.0.0.1\r\n"
        f"Authorization: {client.headers['authorization']}\r\n\r\n"
    )
    opened.sendall(request.encode())
    assert opened.recv(65536).startswith(b"HTTP/1.1 200 ")
    with socket.create_connection(("127.0.0.1", live.port), timeout=LONGEST) as silent:
        assert silent.recv(1) == b""  # which came later, and had its whole time
    client.post(f"/api/registrations/{registration['id']}/submit")
    received = b""
    while b'"submitted"' not in received:
        received += opened.recv(65536)
