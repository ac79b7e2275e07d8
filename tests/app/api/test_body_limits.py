"""Bodies that are too large, too deep or too slow are refused, before the login and before they are read."""

import json
import socket
from collections.abc import Iterator
from contextlib import contextmanager

import httpx
import pytest

from app.api import body_limits
from app.api.body_limits import DEEPEST, LARGEST_BODY, depth
from tests.app.live import LiveServer
from tests.app.rest import sentence
from tests.app.waiting import LONGEST

JSON = {"content-type": "application/json"}


@contextmanager
def connection(live: LiveServer) -> Iterator[socket.socket]:
    with socket.create_connection(("127.0.0.1", live.port), timeout=LONGEST) as opened:
        yield opened


def head(path: str, *lines: str) -> bytes:
    """The beginning of a request that sends JSON."""
    own = ("Host: 127.0.0.1", "Content-Type: application/json", *lines)
    return "\r\n".join([f"POST {path} HTTP/1.1", *own, "", ""]).encode()


def until_closed(opened: socket.socket) -> bytes:
    received = b""
    while data := opened.recv(65536):
        received += data
    return received


@pytest.mark.parametrize("path", ["/api/sign-in", "/api/tasks/1/registration", "/api/nothing-here", "/"])
def test_a_large_body_is_refused_unread_and_before_the_login(live: LiveServer, path: str) -> None:
    with connection(live) as opened:
        opened.sendall(head(path, f"Content-Length: {100 * LARGEST_BODY}"))  # and nothing of it
        answer = until_closed(opened)
    assert answer.startswith(b"HTTP/1.1 413 ") and b"at most 1 MB" in answer


def test_a_body_that_does_not_say_how_large_it_is_is_cut_off(live: LiveServer) -> None:
    pieces = (b" " * 65536 for _ in range(LARGEST_BODY // 65536 + 1))
    answer = live.stranger().post("/api/sign-in", content=pieces, headers=JSON)
    assert "at most 1 MB" in sentence(answer, 413)


def test_no_content_type_gets_around_it(live: LiveServer) -> None:
    headers = {"content-type": "multipart/form-data; boundary=x"}
    answer = live.stranger().post("/api/sign-in", content=b" " * (LARGEST_BODY + 1), headers=headers)
    assert answer.status_code == 413


def test_a_nul_is_refused_and_what_only_looks_like_one_is_not(live: LiveServer) -> None:
    stranger = live.stranger()
    for name in (b"\\u0000", b"ann\\u0000", b"\\\\\\u0000"):
        answer = stranger.post(
            "/api/sign-in", content=b'{"name": "' + name + b'", "password": "x"}', headers=JSON
        )
        assert "U+0000" in sentence(answer, 422)
    assert "U+0000" in sentence(stranger.get("/api/tasks?state=%00"), 422)
    written = b'{"name": "\\\\u0000", "password": "x"}'  # a backslash, and five more characters
    assert stranger.post("/api/sign-in", content=written, headers=JSON).status_code == 401


@pytest.mark.parametrize(("bracket", "end"), [("[", "]"), ('{"a":', "}")])
@pytest.mark.parametrize("levels", [DEEPEST + 1, 900, 100_000])
def test_deep_json_is_refused(live: LiveServer, bracket: str, end: str, levels: int) -> None:
    content = bracket * levels + "1" + end * levels
    answer = live.stranger().post("/api/sign-in", content=content, headers=JSON)
    assert "deeper than" in sentence(answer, 422)


def test_what_is_not_deep_reaches_its_route(live: LiveServer) -> None:
    body = {"name": "[" * 60, "password": '\\"[{' * 60, "more": [[0]] * 1000}
    assert "do not belong together" in sentence(live.stranger().post("/api/sign-in", json=body), 401)


def test_a_body_that_does_not_come_is_given_up(live: LiveServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(body_limits, "SECONDS_FOR_A_BODY", 0.2)
    with connection(live) as opened:
        opened.sendall(head("/api/sign-in", "Content-Length: 50") + b'{"name"')
        answer = until_closed(opened)
    assert answer.startswith(b"HTTP/1.1 408 ") and b"did not come in time" in answer


def test_an_upload_that_stops_is_given_up(
    live: LiveServer, admin: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(body_limits, "SECONDS_FOR_A_BODY", 0.2)
    own = (
        f"Authorization: {admin.headers['authorization']}",
        "Content-Length: 5000000",
        "Content-Type: multipart/form-data; boundary=x",
    )
    upload = "\r\n".join(["POST /api/datasets HTTP/1.1", "Host: 127.0.0.1", *own, "", "--x\r\n"]).encode()
    with connection(live) as opened:
        opened.sendall(upload)
        answer = until_closed(opened)
    assert answer.startswith(b"HTTP/1.1 408 ")


def test_a_large_upload_is_no_large_body(live: LiveServer, admin: httpx.Client) -> None:
    answer = admin.post("/api/datasets", files={"file": ("x.zip", b" " * (2 * LARGEST_BODY))})
    assert "zip" in sentence(answer, 422)
    assert live.stranger().post("/api/datasets", files={"file": ("x.zip", b" ")}).status_code == 401


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (b"", 0),
        (b"1", 0),
        (b"[]", 1),
        (b'{"a": [{}]}', 3),
        (b'"[[["', 0),
        (b'["\\"[[", []]', 2),
        (b'["\\\\", [["]"]]]', 3),
        (b"]]][", 0),
        (b'"never closed [[', 0),
    ],
)
def test_depth_is_that_of_brackets_outside_strings(text: bytes, expected: int) -> None:
    assert depth(text) == expected


def test_depth_is_told_of_any_megabyte() -> None:
    """Whatever a stranger sends is looked at once: from each quote on anew, it would take hours."""
    assert depth(b'"' + b'\\"' * (LARGEST_BODY // 2)) == 0
    assert depth(b"[" * LARGEST_BODY) == LARGEST_BODY
    assert depth(json.dumps([[0.5] * 4] * 40_000).encode()) == 2
