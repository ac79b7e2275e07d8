"""Registrations by REST alone: a script can do all that a page can, and is logged like any other."""

import itertools
import math
from dataclasses import asdict
from typing import Any

import httpx
import numpy as np
import pytest

from app.labeling.layers import Layers
from app.storage.roles import Role
from registration_core.geometry import pose
from tests.app.live import LiveServer
from tests.app.rest import begin, kinds, log_of, put_pose, sentence, shown, url_of
from tests.app.small_dataset import TOOL, true_pose

ACTIONS = ("undo", "redo", "reset", "accept", "dismiss", "submit")


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


def test_every_change_has_a_larger_revision(live: LiveServer, script: httpx.Client) -> None:
    first = begin(script)
    moved = put_pose(script, first, true_pose(TOOL)).json()
    undone = script.post(f"{url_of(first)}/undo").json()
    live.services.live_sessions.close_idle(0.0)
    opened_again = script.get(url_of(first)).json()
    revisions = [state["revision"] for state in (first, moved, undone, opened_again)]
    assert revisions == sorted(set(revisions))


def test_layers_are_chosen(script: httpx.Client, registration: dict[str, Any]) -> None:
    assert registration["layers"] == asdict(Layers())
    url = f"{url_of(registration)}/layers"
    chosen = {"cloud": False, "mesh": True, "texture": False, "fine": False, "agreement": True}
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
    session = live.live_session(registration["id"]).session
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
