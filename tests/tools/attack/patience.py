"""Attacks on the server's time: guesses of passwords, and connections that do not come to the point."""

import socket
import uuid
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import httpx

from app.access.throttle import FREE_ATTEMPTS
from app.api.body_limits import SECONDS_FOR_A_BODY
from app.serving.connections import SECONDS_FOR_HEADERS
from tests.tools.attack.target import Outcome, Target

AT_ONCE = 40
SILENT = 200
SECONDS_TO_ANSWER = 10.0
"""In which somebody else is answered, on a machine that is busy."""


def attack_throttle(target: Target) -> Iterator[Outcome]:
    """Few guesses are looked at, however they are spelled, addressed, or made at once."""
    for how, spell, headers in (
        ("plainly", lambda name, i: name, lambda i: {}),
        ("with spaces", lambda name, i: " " * i + name, lambda i: {}),
        ("as others", lambda name, i: name, lambda i: {"x-forwarded-for": f"192.0.2.{i}"}),
    ):
        name = uuid.uuid4().hex
        found = [_guess(target, spell(name, i), headers(i)) for i in range(2 * FREE_ATTEMPTS)]
        yield Outcome(f"guesses {how}", 429 in found and set(found) <= {401, 429}, str(found))
    name = uuid.uuid4().hex
    with ThreadPoolExecutor(AT_ONCE) as pool:
        guesses = [pool.submit(_guess, target, name, {}) for _ in range(AT_ONCE)]
        yield _others_are_answered(target, f"{AT_ONCE} guesses at once")
        found = sorted(guess.result() for guess in guesses)
    looked_at = found.count(401)
    yield Outcome("guesses at once", looked_at < 2 * FREE_ATTEMPTS and set(found) <= {401, 429}, str(found))


def attack_silence(target: Target) -> Iterator[Outcome]:
    """Connections that say nothing, or too little, are closed, and keep nobody waiting meanwhile."""
    if not target.has_time:
        return
    head = f"POST /api/sign-in HTTP/1.1\r\nHost: {target.host}\r\n"
    beginnings = {
        "nothing": "",
        "half a line": "GET /api/he",
        "half a head": head,
        "a head": f"{head}Content-Type: application/json\r\nContent-Length: 1000\r\n\r\n",
        "half a body": f"{head}Content-Type: application/json\r\nContent-Length: 1000\r\n\r\n{{",
    }
    sockets: list[tuple[str, socket.socket]] = []
    for what, beginning in beginnings.items():
        for _ in range(SILENT // len(beginnings)):
            opened = socket.create_connection(("127.0.0.1", target.port), timeout=SECONDS_TO_ANSWER)
            opened.sendall(beginning.encode())
            sockets.append((what, opened))
    yield _others_are_answered(target, f"{SILENT} connections that say too little")
    for what, opened in sockets:
        opened.settimeout(SECONDS_FOR_HEADERS + SECONDS_FOR_A_BODY + SECONDS_TO_ANSWER)
        yield Outcome(f"a connection with {what}", _is_closed(opened), "")
        opened.close()


def _guess(target: Target, name: str, headers: dict[str, str]) -> int:
    body = {"name": name, "password": "wrong"}
    return httpx.post(f"{target.url}/api/sign-in", json=body, headers=headers, timeout=60).status_code


def _others_are_answered(target: Target, during: str) -> Outcome:
    try:
        status = httpx.get(f"{target.url}/sign-in", timeout=SECONDS_TO_ANSWER).status_code
    except httpx.HTTPError as error:
        return Outcome(f"others during {during}", False, str(error))
    return Outcome(f"others during {during}", status == 200, str(status))


def _is_closed(opened: socket.socket) -> bool:
    try:
        while opened.recv(65536):
            pass
    except ConnectionError:
        return True
    except TimeoutError:
        return False
    return True
