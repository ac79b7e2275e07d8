"""`./scripts/attack` withstands its own quick part, and sees what does not withstand it."""

import os
from collections.abc import Callable, Iterator

import pytest
from starlette.types import Receive, Scope, Send

from app.api.body_limits import BodyLimits
from app.api.host_names import HostNames
from app.storage.roles import Role
from tests.app.conftest import cluster, demo, imported_state, own_live, state_dir
from tests.app.live import LiveServer
from tests.tools.attack.__main__ import KINDS, own_server, report
from tests.tools.attack.malformed import attack_bodies, attack_headers
from tests.tools.attack.routes import attack_routes, needed
from tests.tools.attack.target import Outcome, Target, target_of

pytestmark = pytest.mark.slow  # a server in a process of its own

__all__ = [
    "cluster",
    "demo",
    "imported_state",
    "own_live",
    "state_dir",
]  # fixtures of the application's tests


@pytest.fixture(scope="module")
def apart() -> Iterator[Target]:
    """A server in a process of its own: its ports are nobody else's."""
    with own_server(has_time=False) as found:
        yield found


@pytest.fixture
def target(own_live: LiveServer) -> Iterator[Target]:
    def script(role: Role):
        return own_live.script(f"a script of role {role}", role)

    with target_of(own_live.port, os.getpid(), script, has_time=False) as found:
        yield found


def failures(outcomes: list[Outcome]) -> list[Outcome]:
    return [outcome for outcome in outcomes if not outcome.withstood]


@pytest.mark.parametrize("kind", KINDS)
def test_a_kind_of_attack_is_withstood(apart: Target, kind: str) -> None:
    outcomes = list(KINDS[kind](apart))
    assert failures(outcomes) == []
    assert outcomes or kind == "silence"


async def let_through(self, scope: Scope, receive: Receive, send: Send) -> None:
    """A door that stands open."""
    await self._app(scope, receive, send)


@pytest.mark.parametrize(
    ("door", "attack", "expected"),
    [(BodyLimits, attack_bodies, "with a deep list"), (HostNames, attack_headers, "Host: evil.example")],
)
def test_an_open_door_is_found(
    target: Target, monkeypatch: pytest.MonkeyPatch, door: type, attack: Callable, expected: str
) -> None:
    monkeypatch.setattr(door, "__call__", let_through)
    assert any(expected in outcome.what for outcome in attack(target) if not outcome.withstood)


def test_a_role_that_may_too_much_is_found(target: Target) -> None:
    target.clients[Role.OPERATOR].headers["authorization"] = target.clients[Role.ADMIN].headers[
        "authorization"
    ]
    found = {outcome.what for outcome in failures(list(attack_routes(target)))}
    assert "POST /api/exports as operator" in found and "GET /api/reports/team as operator" in found
    assert all(what.endswith("as operator") for what in found)


def test_what_failed_is_printed_and_counted(capsys: pytest.CaptureFixture[str]) -> None:
    good, bad = Outcome("a", True, ""), Outcome("b", False, "200: all of it")
    assert report({"one": [good], "two": [good]}) == 0
    assert report({"one": [good], "two": [good, bad]}) == 1
    assert capsys.readouterr().out.splitlines()[-3:] == [
        f"{'one':<18}{1:>8}{0:>8}",
        f"{'two':<18}{2:>8}{1:>8}",
        "FAILED two: b: 200: all of it",
    ]


@pytest.mark.parametrize(
    ("operation", "role"),
    [
        ("GET /api/health", None),
        ("GET /api/me", Role.PARTICIPANT),
        ("PUT /api/registrations/{registration_id}/pose", Role.PARTICIPANT),
        ("GET /api/registrations/{registration_id}/events", Role.OPERATOR),
        ("GET /api/something/new", Role.OPERATOR),
        ("PUT /api/datasets/{dataset_id}/risk", Role.REVIEWER),
        ("DELETE /api/studies/{study_id}/participants/{participant_id}", Role.ADMIN),
    ],
)
def test_the_least_role_of_a_route(operation: str, role: Role | None) -> None:
    assert needed(operation) is role
