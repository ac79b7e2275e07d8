"""Registrations by REST alone: a script can do all that a page can, and is logged like any other."""

import itertools
import json
import math
import time
from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest

from app.api import registrations
from app.auth import Actor, Role
from app.labeling.desk import Seat
from registration_core import pose
from tests.app.live import LiveServer
from tests.app.rest import begin, kinds, log_of, sentence
from tests.app.small_dataset import TOOL, true_pose
from tests.app.waiting import LONGEST, wait_until

ACTIONS = ("undo", "redo", "reset", "accept", "dismiss", "submit")


def url_of(registration: dict[str, Any]) -> str:
    return f"/api/registrations/{registration['id']}"


def put_pose(client: httpx.Client, registration: dict[str, Any], T: object) -> httpx.Response:
    # written by json, since httpx refuses to send the NaN that Python's json reads
    content = json.dumps({"T_world_object": T.tolist() if isinstance(T, np.ndarray) else T})
    url = f"{url_of(registration)}/pose"
    return client.put(url, content=content, headers={"content-type": "application/json"})


def shown(answer: httpx.Response) -> np.ndarray:
    assert answer.status_code == 200, answer.text
    return np.array(answer.json()["T_world_object"])


@pytest.fixture
def registration(script: httpx.Client) -> dict[str, Any]:
    return begin(script)


# -- what is seen


def test_the_state_says_how_depth_agrees(script: httpx.Client, registration: dict[str, Any]) -> None:
    right = put_pose(script, registration, true_pose(TOOL)).json()["agreement"]
    assert right["inlier_share"] > 0.9
    assert right["median_residual"] < 0.002
    assert right["match"] + right["in_front"] + right["behind"] + right["no_data"] == pytest.approx(1.0)
    wrong = put_pose(script, registration, true_pose(TOOL) @ pose.exp([0.02, 0, 0, 0, 0, 0.3])).json()
    assert wrong["agreement"]["inlier_share"] < right["inlier_share"] - 0.2
    assert put_pose(script, registration, pose.exp([9.0, 9.0, 0, 0, 0, 0])).json()["agreement"] is None


def test_layers_are_chosen(script: httpx.Client, registration: dict[str, Any]) -> None:
    assert registration["layers"] == {"cloud": True, "mesh": True, "agreement": False}
    url = f"{url_of(registration)}/layers"
    chosen = {"cloud": False, "mesh": True, "agreement": True}
    assert script.put(url, json=chosen).json()["layers"] == chosen
    assert "cloud" in sentence(script.put(url, json={"cloud": "maybe"}), 422)


# -- a whole registration


def test_a_script_does_a_whole_registration(script: httpx.Client) -> None:
    registration = begin(script)
    url = url_of(registration)
    start, first, second = np.array(registration["T_world_object"]), true_pose(TOOL), pose.exp([0.1] * 6)
    assert (registration["state"], registration["can_undo"], registration["can_redo"]) == (
        "open",
        False,
        False,
    )
    assert np.allclose(shown(put_pose(script, registration, first)), first)
    assert np.allclose(shown(put_pose(script, registration, second)), second)
    assert np.allclose(shown(script.post(f"{url}/undo")), first)
    assert script.get(url).json()["can_redo"]
    assert np.allclose(shown(script.post(f"{url}/redo")), second)
    assert np.allclose(shown(script.post(f"{url}/reset")), start)
    assert np.allclose(shown(script.post(f"{url}/undo")), second)
    assert np.allclose(shown(put_pose(script, registration, first)), first)
    submitted = script.post(f"{url}/submit")
    assert np.allclose(shown(submitted), first)
    state = script.get(url).json()
    assert state == submitted.json()
    assert (state["state"], state["can_undo"], state["can_redo"]) == ("submitted", False, False)

    events = log_of(script, registration["id"])
    assert [event["kind"] for event in events] == [
        "opened", "set_pose", "set_pose", "undo", "redo", "reset", "undo", "set_pose", "submit",
    ]  # fmt: skip
    assert {event["actor"] for event in events} == {"script"}
    assert {event["user_id"] for event in events} == {script.get("/api/me").json()["id"]}
    assert [event["sequence"] for event in events] == list(range(1, 10))
    moves = events[1:]
    assert np.allclose(moves[0]["T_before"], start) and np.allclose(moves[0]["T_after"], first)
    for before, after in itertools.pairwise(moves):
        assert np.allclose(before["T_after"], after["T_before"])
    times = [(event["utc"], event["monotonic_seconds"]) for event in events]
    assert times == sorted(times)


def test_a_registration_tells_where_the_object_is(script: httpx.Client) -> None:
    registration = begin(script)
    frames = {
        frame["id"]: frame for scene in script.get("/api/scenes").json()["items"] for frame in scene["frames"]
    }
    T_world_camera = np.array(frames[registration["frame_id"]]["T_world_camera"])
    T_camera_object = np.array(registration["T_camera_object"])
    assert np.allclose(T_world_camera @ T_camera_object, registration["T_world_object"])
    assert T_camera_object[2, 3] > 0  # before the camera
    assert registration["view_url"] == f"/view/{registration['id']}/"
    assert registration["saved"] and not registration["dragging"]
    assert registration["confidence"] is registration["snap"] is registration["offer"] is None


def test_beginning_again_goes_on(script: httpx.Client, registration: dict[str, Any]) -> None:
    put_pose(script, registration, true_pose(TOOL))
    again = begin(script)
    assert again["id"] == registration["id"]
    assert np.allclose(again["T_world_object"], true_pose(TOOL)) and again["can_undo"]
    assert kinds(script, registration["id"]) == ["opened", "set_pose", "opened"]


def test_people_are_marked_as_such(live: LiveServer) -> None:
    person = live.person("a person with a browser")
    registration = begin(person)
    put_pose(person, registration, true_pose(TOOL))
    assert {event["actor"] for event in log_of(person, registration["id"])} == {"human"}


def test_a_moved_degree_of_freedom_is_named(script: httpx.Client, registration: dict[str, Any]) -> None:
    T = np.array(registration["T_world_object"])
    put_pose(script, registration, T @ pose.exp([0, 0.01, 0, 0, 0, 0]))
    assert log_of(script, registration["id"])[-1]["dof"] == ["ty"]


def test_another_frame_can_be_shown(script: httpx.Client, registration: dict[str, Any]) -> None:
    task = script.get(f"/api/tasks/{registration['task_id']}").json()
    frames = [f["id"] for f in script.get(f"/api/scenes/{task['scene']['id']}").json()["frames"]]
    other = next(frame for frame in frames if frame != registration["frame_id"])
    url = f"{url_of(registration)}/frame"
    changed = script.put(url, json={"frame_id": other}).json()
    assert changed["frame_id"] == other
    assert changed["T_world_object"] == registration["T_world_object"]
    assert not np.allclose(changed["T_camera_object"], registration["T_camera_object"])
    assert "does not belong to this scene" in sentence(script.put(url, json={"frame_id": 999}), 409)
    assert kinds(script, registration["id"]) == ["opened", "frame"]


# -- what is refused


def with_value(row: int, column: int, value: float) -> list[list[float]]:
    T = np.eye(4).tolist()
    T[row][column] = value
    return T


BAD_POSES = {
    "scaled": (np.diag([2.0, 2.0, 2.0, 1.0]).tolist(), "scales or shears"),
    "sheared": (with_value(0, 1, 0.5), "scales or shears"),
    "mirrored": (np.diag([-1.0, 1.0, 1.0, 1.0]).tolist(), "reflection"),
    "all zero": (np.zeros((4, 4)).tolist(), "last row"),
    "last row": (with_value(3, 0, 1.0), "last row"),
    "NaN": (with_value(0, 3, math.nan), "finite"),
    "NaN in the rotation": (with_value(1, 1, math.nan), "finite"),
    "infinite": (with_value(2, 3, math.inf), "finite"),
    "3x4": (np.eye(4)[:3].tolist(), "4x4"),
    "flat": (np.eye(4).ravel().tolist(), "list"),
    "ragged": ([[1, 0, 0, 0], [0, 1, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "4x4"),
    "empty": ([], "4x4"),
    "words": ([["a"] * 4] * 4, "number"),
    "nothing": (None, "list"),
    "too far away": (with_value(0, 3, 1e300), "metres"),
}


@pytest.mark.parametrize("case", BAD_POSES)
def test_a_pose_that_is_none_is_refused(
    script: httpx.Client, registration: dict[str, Any], case: str
) -> None:
    T, words = BAD_POSES[case]
    said = sentence(put_pose(script, registration, T), 422)
    assert "T_world_object" in said and words in said
    assert script.get(url_of(registration)).json() == registration
    assert kinds(script, registration["id"]) == ["opened"]


def test_a_pose_that_is_missing_is_named(script: httpx.Client, registration: dict[str, Any]) -> None:
    url = f"{url_of(registration)}/pose"
    assert "body.T_world_object" in sentence(script.put(url, json={}), 422)
    headers = {"content-type": "application/json"}
    assert "JSON" in sentence(script.put(url, content=b"{", headers=headers), 422)


def test_rounding_in_a_pose_is_removed(script: httpx.Client, registration: dict[str, Any]) -> None:
    rounded = np.round(true_pose(TOOL), 5)
    R = shown(put_pose(script, registration, rounded))[:3, :3]
    assert np.allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.allclose(R, rounded[:3, :3], atol=1e-4)


def test_there_is_nothing_to_undo_or_accept_at_first(
    script: httpx.Client, registration: dict[str, Any]
) -> None:
    for action, words in (
        ("undo", "nothing to undo"),
        ("redo", "nothing to redo"),
        ("accept", "offers no pose"),
        ("dismiss", "offers no pose"),
    ):
        assert words in sentence(script.post(f"{url_of(registration)}/{action}"), 409)
    assert kinds(script, registration["id"]) == ["opened"]


def test_a_submitted_registration_stays_as_it_is(script: httpx.Client, registration: dict[str, Any]) -> None:
    url = url_of(registration)
    put_pose(script, registration, true_pose(TOOL))
    submitted = script.post(f"{url}/submit").json()
    for action in ACTIONS:
        assert "was submitted" in sentence(script.post(f"{url}/{action}"), 409)
    assert "was submitted" in sentence(put_pose(script, registration, np.eye(4)), 409)
    assert script.get(url).json() == submitted
    assert kinds(script, registration["id"]) == ["opened", "set_pose", "submit"]


def test_during_a_drag_a_script_has_to_wait(live: LiveServer, script: httpx.Client) -> None:
    registration = begin(script)
    session = seat_of(live, registration).session
    session.start_drag()
    state = script.get(url_of(registration)).json()
    assert state["dragging"] and not state["saved"]
    assert "being dragged" in sentence(put_pose(script, registration, true_pose(TOOL)), 409)
    assert "being dragged" in sentence(script.post(f"{url_of(registration)}/submit"), 409)
    session.end_drag()
    assert shown(put_pose(script, registration, true_pose(TOOL))) is not None


def test_nobody_else_reaches_a_registration(live: LiveServer, registration: dict[str, Any]) -> None:
    url = url_of(registration)
    calls = [("GET", url), ("GET", f"{url}/stream"), ("POST", f"{url}/snaps")]
    calls += [("POST", f"{url}/{action}") for action in ACTIONS]
    others = [live.script(f"another {role}", role) for role in Role]
    for other in others:
        for method, address in calls:
            assert "of yours" in sentence(other.request(method, address), 404)
        assert "of yours" in sentence(put_pose(other, registration, np.eye(4)), 404)
        assert "of yours" in sentence(other.put(f"{url}/frame", json={"frame_id": 1}), 404)
    for method, address in calls:
        sentence(live.stranger().request(method, address), 401)


def test_reviewers_may_read_any_log_and_operators_their_own(
    live: LiveServer, script: httpx.Client, registration: dict[str, Any]
) -> None:
    events = log_of(script, registration["id"])
    for role in (Role.REVIEWER, Role.ADMIN):
        assert log_of(live.script(f"reading {role}", role), registration["id"]) == events
    other = live.script("reading operator")
    assert "of yours" in sentence(other.get(f"{url_of(registration)}/events"), 404)
    sentence(live.stranger().get(f"{url_of(registration)}/events"), 401)


def test_the_log_comes_in_pages(script: httpx.Client, registration: dict[str, Any]) -> None:
    for i in range(5):
        put_pose(script, registration, pose.exp([0.01 * i, 0, 0.5, 0, 0, 0]))
    url = f"{url_of(registration)}/events"
    seen, after = [], 0
    while after is not None:
        page = script.get(url, params={"after": after, "limit": 4}).json()
        seen += [event["sequence"] for event in page["items"]]
        after = page["next"]
    assert seen == [1, 2, 3, 4, 5, 6]


@pytest.mark.parametrize("registration_id", ["999999", "0", "x", "1e3", str(10**20)])
def test_a_registration_that_does_not_exist_is_said(script: httpx.Client, registration_id: str) -> None:
    for address in ("", "/events", "/stream"):
        answer = script.get(f"/api/registrations/{registration_id}{address}")
        sentence(answer, 404 if registration_id == "999999" else 422)


# -- the stream


def seat_of(live: LiveServer, registration: dict[str, Any]) -> Seat:
    (seat,) = [s for s in live.services.desk._seats.values() if s.registration.id == registration["id"]]
    return seat


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
    session = seat_of(live, registration).session
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
    monkeypatch.setattr(registrations, "SECONDS_BETWEEN_SIGNS_OF_LIFE", 0.05)
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
    seat = seat_of(live, registration)
    with script.stream("GET", f"{url_of(registration)}/stream") as answer:
        told = messages(answer)  # kept: a generator that is thrown away closes the stream
        next(told)
        assert seat.watchers == 1
    wait_until(lambda: seat.watchers == 0, "the stream to be left")
    seat.session.set_pose(true_pose(TOOL), Actor.SCRIPT)


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
