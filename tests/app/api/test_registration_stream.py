"""The stream of a registration's changes: nothing is missed, nothing stays open."""

import itertools
import json
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from typing import Any

import httpx
import numpy as np
import pytest

from app.access.auth import Identity
from app.api import registration_stream
from app.storage.roles import Actor, Role
from registration_core.geometry import pose
from tests.app.live import LiveServer
from tests.app.rest import begin, put_pose, url_of
from tests.app.small_dataset import TOOL, true_pose
from tests.app.waiting import LONGEST, wait_until


@pytest.fixture
def registration(script: httpx.Client) -> dict[str, Any]:
    return begin(script)


def tasks_of(client: httpx.Client) -> list[dict[str, Any]]:
    """As the list of tasks has them."""
    return client.get("/api/tasks").json()["items"]


def messages(answer: httpx.Response) -> Iterator[dict[str, Any]]:
    """The registrations that a stream tells."""
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/event-stream")
    kind = None
    deadline = time.monotonic() + LONGEST  # pings keep a silent stream alive for ever
    for line in answer.iter_lines():
        assert time.monotonic() < deadline, "the stream tells nothing"
        name, _, value = line.partition(": ")
        if name == "event":
            kind = value
        elif name == "data":
            assert kind == "registration"
            yield json.loads(value)


def test_a_stream_tells_the_state_at_once_and_after_each_change(
    script: httpx.Client, registration: dict[str, Any]
) -> None:
    with script.stream("GET", f"{url_of(registration)}/stream") as answer:
        told = messages(answer)
        assert next(told) == registration
        changed = put_pose(script, registration, true_pose(TOOL)).json()
        assert next(told) == changed
        undone = script.post(f"{url_of(registration)}/undo").json()
        assert next(told) == undone
        submitted = script.post(f"{url_of(registration)}/submit").json()
        assert next(told) == submitted


def test_a_stream_may_skip_but_always_tells_the_last(
    live: LiveServer, script: httpx.Client, registration: dict[str, Any]
) -> None:
    session = live.live_session(registration["id"]).session
    with script.stream("GET", f"{url_of(registration)}/stream") as answer:
        told = messages(answer)
        next(told)
        session.start_drag()
        for i in range(200):
            session.drag_to(pose.exp([0.001 * i, 0, 0.5, 0, 0, 0]))
        session.end_drag()
        count = 0
        for message in told:
            count += 1
            if not message["dragging"]:
                break
        assert count < 50
        assert np.allclose(message["T_world_object"], pose.exp([0.199, 0, 0.5, 0, 0, 0]))
        assert message["saved"] and message["can_undo"]


def test_a_stream_gives_signs_of_life_until_the_login_ends(
    live: LiveServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(registration_stream, "SECONDS_BETWEEN_SIGNS_OF_LIFE", 0.05)
    person = live.person("whose login ends")
    registration = begin(person)
    with person.stream("GET", f"{url_of(registration)}/stream") as answer:
        told = messages(answer)
        assert [next(told) for _ in range(4)] == [registration] * 4
        assert person.post("/api/sign-out").status_code == 204
        for again in told:
            assert again == registration


def test_a_stream_keeps_its_session_until_it_is_left(live: LiveServer, script: httpx.Client) -> None:
    registration = begin(script, 1)
    live_session = live.live_session(registration["id"])
    with script.stream("GET", f"{url_of(registration)}/stream") as answer:
        told = messages(answer)  # kept: a generator that is thrown away closes the stream
        next(told)
        assert live_session.watchers == 1
    wait_until(lambda: live_session.watchers == 0, "the stream to be left")
    live_session.session.set_pose(true_pose(TOOL), Actor.SCRIPT)


def test_a_newer_page_takes_over_and_the_older_says_so(
    script: httpx.Client, registration: dict[str, Any]
) -> None:
    url = f"{url_of(registration)}/stream"
    with script.stream("GET", url, params={"page": "older"}) as older, script.stream("GET", url) as watching:
        lines = older.iter_lines()
        assert "event: registration" in itertools.takewhile(bool, lines)
        watched = messages(watching)
        assert next(watched) == registration
        with script.stream("GET", url, params={"page": "newer"}) as newer:
            told = messages(newer)
            assert next(told) == registration
            ending = list(lines)
            assert "event: taken_over" in ending and "event: registration" not in ending
            changed = put_pose(script, registration, true_pose(TOOL)).json()
            assert next(told) == changed
            assert next(watched) == changed


def test_a_stream_tells_who_else_has_the_task_open(live: LiveServer, script: httpx.Client) -> None:
    ann, bob = live.person("ann of the task"), live.person("bob of the task")
    hers, his, watched, elsewhere = begin(ann), begin(bob), begin(script), begin(bob, 1)

    def here() -> set[str]:
        return {who["name"] for who in tasks_of(script)[0]["operators"] if who["is_here"]}

    def opened(client: httpx.Client, registration: dict[str, Any]) -> AbstractContextManager[httpx.Response]:
        return client.stream(
            "GET", f"{url_of(registration)}/stream", params={"page": str(registration["id"])}
        )

    with opened(ann, hers) as answer:
        told = messages(answer)
        assert next(told)["others"] == []
        with (
            opened(bob, elsewhere),
            script.stream("GET", f"{url_of(watched)}/stream"),  # a script watches, and is no page
            opened(bob, his) as seen_by_bob,
        ):
            told_to_bob = messages(seen_by_bob)
            assert next(told_to_bob)["others"] == ["ann of the task"]
            assert next(told)["others"] == ["bob of the task"]
            assert here() == {"ann of the task", "bob of the task"}
        assert next(told)["others"] == []
    wait_until(lambda: here() == set(), "all to leave")


def test_who_takes_part_in_a_study_and_others_do_not_see_each_other(
    live: LiveServer, script: httpx.Client
) -> None:
    ordinary = live.person("operator beside a study")
    registration = begin(ordinary)
    name = "P77 beside an operator"
    user = live.services.auth.ensure_user(name, Role.PARTICIPANT)
    trial = live.services.live_sessions.start(
        registration["task_id"], Identity(user.id, name, Role.PARTICIPANT, Actor.HUMAN)
    )
    url = f"{url_of(registration)}/stream"
    release = trial.page_lease.take("a trial's page", lambda: None)
    with ordinary.stream("GET", url, params={"page": "ordinary"}) as answer:
        told = messages(answer)
        assert next(told)["others"] == []
        assert trial.others() == ()
    assert name not in str(tasks_of(script))
    release()
