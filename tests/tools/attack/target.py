"""What is attacked, and what came of it."""

import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import httpx

from app.storage.roles import Role
from tests.app.api.study_rest import invite, new_study
from tests.app.waiting import LONGEST


@dataclass(frozen=True)
class Outcome:
    """One thing that was tried."""

    what: str
    withstood: bool
    said: str
    """What came back, for who looks into a failure."""


@dataclass(frozen=True)
class Target:
    """A server on the loopback, and people of all roles there."""

    port: int
    pid: int
    """Of the server's process."""
    clients: dict[Role, httpx.Client]
    login: dict[str, str]
    """Headers of the login cookie of a participant, which a browser would send from any page."""
    registration_id: int
    """Of the participant, with its view open."""
    has_time: bool
    """Whether attacks may take as long as the server's patience lasts."""

    @property
    def host(self) -> str:
        """As in the Host header."""
        return f"127.0.0.1:{self.port}"

    @property
    def url(self) -> str:
        """Where it answers."""
        return f"http://{self.host}"

    @property
    def document(self) -> dict[str, Any]:
        """The description of its interface."""
        return self.clients[Role.ADMIN].get("/api/openapi.json").json()

    @contextmanager
    def connection(self) -> Iterator[socket.socket]:
        """A connection of its own, for what no well-behaved client sends."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=LONGEST) as opened:
            yield opened

    def answer(self, *sent: bytes) -> bytes:
        """What the server answers to bytes, until it closes the connection or has said its head."""
        with self.connection() as opened:
            received = b""
            try:
                for piece in sent:
                    opened.sendall(piece)
                while b"\r\n\r\n" not in received and (data := opened.recv(65536)):
                    received += data
            except (ConnectionError, TimeoutError):  # what was not answered in time was not refused
                pass
            return received


Attack = Callable[[Target], Iterator[Outcome]]
"""Tries things of one kind, and tells of each whether the server withstood it."""


@contextmanager
def target_of(
    port: int, pid: int, script: Callable[[Role], httpx.Client], has_time: bool
) -> Iterator[Target]:
    """A server as a target; `script` signs somebody of a role in. In the end nobody is connected any more."""
    clients = {role: script(role) for role in (Role.OPERATOR, Role.REVIEWER, Role.ADMIN)}
    link = invite(clients[Role.ADMIN], new_study(clients[Role.ADMIN]), "expert")["link"]
    participant = httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=LONGEST)
    participant.post("/api/sign-in/study", json={"token": link.partition("#")[2]}).raise_for_status()
    for step in ("consent", "answers"):
        participant.post(f"/api/participation/{step}", json={})
    registration_id = begin_own(participant)
    participant.get(f"/view/{registration_id}/").raise_for_status()
    cookie = "; ".join(f"{name}={value}" for name, value in participant.cookies.items())
    people = {Role.PARTICIPANT: participant} | clients
    try:
        yield Target(port, pid, people, {"cookie": cookie}, registration_id, has_time)
    finally:
        for client in people.values():
            client.close()


def begin_own(participant: httpx.Client) -> int:
    """The participant's first registration."""
    task_id = participant.get("/api/participation").json()["task"]["id"]
    answer = participant.post(f"/api/tasks/{task_id}/registration")
    answer.raise_for_status()
    return answer.json()["id"]


def status_of(answer: bytes) -> int:
    """The status of a raw answer; 0 where the connection was closed without one."""
    return int(answer.split(b" ", 2)[1]) if answer.startswith(b"HTTP/1.1 ") else 0


def refused(what: str, answer: httpx.Response | bytes, *allowed: int) -> Outcome:
    """Whether an answer is a refusal: one of the allowed statuses, 4xx where none is named, 0 for silence."""
    status = status_of(answer) if isinstance(answer, bytes) else answer.status_code
    said = answer[-200:].decode(errors="replace") if isinstance(answer, bytes) else answer.text[:200]
    withstood = status in allowed if allowed else status == 0 or 400 <= status < 500
    return Outcome(what, withstood, f"{status}: {said}")


def unbroken(what: str, answer: bytes) -> Outcome:
    """Whether the server answered, whatever that was, and did not fail over it."""
    status = status_of(answer)
    return Outcome(what, 0 < status < 500, f"{status}: {answer[-200:].decode(errors='replace')}")
