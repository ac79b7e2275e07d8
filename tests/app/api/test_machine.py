"""Live snapping and conditions by REST, with real workers."""

from typing import Any

import httpx
import numpy as np
import pytest

from registration_core.geometry import pose
from registration_core.geometry.pose_error import adi
from tests.app.live import LiveServer
from tests.app.rest import begin, finished_snap, kinds, log_of, sentence, url_of
from tests.app.small_dataset import TOOL, true_pose
from tests.app.waiting import wait_until

NEAR = pose.perturbed(true_pose(TOOL), 0.012, np.radians(10), np.random.default_rng(3))


def begin_under(admin: httpx.Client, condition: str) -> dict[str, Any]:
    """A registration of a new task for the angle tool of scene 1."""
    task = admin.get("/api/tasks").json()["items"][0]
    wanted = {"scene_id": task["scene"]["id"], "object_id": task["object"]["id"], "condition": condition}
    task_id = admin.post("/api/tasks", json=wanted).json()["id"]
    return admin.post(f"/api/tasks/{task_id}/registration").json()


def put_near(client: httpx.Client, registration: dict[str, Any]) -> dict[str, Any]:
    answer = client.put(f"{url_of(registration)}/pose", json={"T_world_object": NEAR.tolist()})
    assert answer.status_code == 200
    return answer.json()


@pytest.fixture
def looked(script: httpx.Client) -> dict[str, Any]:
    """A registration near the truth, with live snapping on and a result there to be seen."""
    registration = begin(script)
    put_near(script, registration)
    url = url_of(registration)
    assert script.put(f"{url}/live", json={"on": True}).json()["is_live"]

    def look() -> dict[str, Any] | None:
        state = script.get(url).json()
        return state if state["live"] is not None else None

    return wait_until(look, "a live result")


def test_it_is_off_and_shows_nothing_at_first(script: httpx.Client) -> None:
    registration = begin(script)
    assert registration["is_live"] is False and registration["live"] is None
    assert registration["condition"] == "snap"


def test_a_live_result_is_seen_and_not_logged(
    script: httpx.Client, looked: dict[str, Any], live: LiveServer
) -> None:
    model = live.live_session(looked["id"]).model
    assert adi(np.array(looked["live"]["T_world_object"]), true_pose(TOOL), model.vertices) < 0.003
    assert 0 <= looked["live"]["confidence"] <= 1
    assert np.allclose(looked["T_world_object"], NEAR)
    assert looked["snap"] is looked["offer"] is None
    assert kinds(script, looked["id"]) == ["opened", "set_pose", "live"]


def test_an_accepted_live_result_is_explained_by_its_estimate(
    script: httpx.Client, looked: dict[str, Any], live: LiveServer
) -> None:
    url = url_of(looked)
    accepted = script.post(f"{url}/accept").json()
    assert accepted["T_world_object"] == looked["live"]["T_world_object"]
    assert accepted["confidence"] == looked["live"]["confidence"] and accepted["live"] is None
    event = log_of(script, looked["id"])[-1]
    assert (event["kind"], event["actor"]) == ("accept", "script")
    snap = finished_snap(script, event["snap_id"])
    assert snap["state"] == "done" and snap["progress"] == 1.0
    assert np.allclose(snap["estimate"]["T_world_object"], event["T_after"])
    row = live.services.log.estimate(event["snap_id"])
    assert row is not None and np.allclose(row.T_world_object_start, NEAR)

    live.services.live_sessions.close_idle(0.0)
    again = script.get(url).json()
    assert np.allclose(again["T_world_object"], event["T_after"])
    assert again["confidence"] == pytest.approx(accepted["confidence"]) and not again["is_live"]
    assert np.allclose(script.post(f"{url}/undo").json()["T_world_object"], NEAR)


def test_an_accepted_live_result_can_be_repeated_by_a_snap(
    script: httpx.Client, looked: dict[str, Any]
) -> None:
    url = url_of(looked)
    script.put(f"{url}/live", json={"on": False})
    script.put(f"{url}/live", json={"on": True})
    wait_until(lambda: script.get(url).json()["live"], "a live result")
    script.post(f"{url}/accept")
    taken = finished_snap(script, log_of(script, looked["id"])[-1]["snap_id"])["estimate"]
    script.post(f"{url}/undo")
    wanted = {name: taken[name] for name in ("seed", "config", "start_spread")} | {"frames": "current"}
    snap_id = script.post(f"{url}/snaps", json=wanted).json()["id"]
    assert finished_snap(script, snap_id)["estimate"]["T_world_object"] == taken["T_world_object"]


def test_in_manual_a_snap_is_refused_in_one_sentence(admin: httpx.Client) -> None:
    registration = begin_under(admin, "manual")
    url = url_of(registration)
    for refused in (admin.post(f"{url}/snaps"), admin.put(f"{url}/live", json={"on": True})):
        assert "done by hand alone" in sentence(refused, 409)
    assert not admin.put(f"{url}/live", json={"on": False}).json()["is_live"]
    assert kinds(admin, registration["id"]) == ["opened"]


def test_in_auto_the_end_of_a_drag_is_followed_by_the_machine(live: LiveServer, admin: httpx.Client) -> None:
    registration = begin_under(admin, "auto")
    session = live.live_session(registration["id"]).session
    session.start_drag()
    session.drag_to(NEAR)
    session.end_drag()
    url = url_of(registration)
    wait_until(lambda: admin.get(url).json()["snap"]["state"] == "done", "the machine's turn")
    events = log_of(admin, registration["id"])
    assert [(e["kind"], e["actor"]) for e in events[1:3]] == [
        ("drag", "human"),
        ("snap_requested", "machine"),
    ]
    outcome = events[3]
    assessment = outcome["detail"]["assessment"]
    sure = assessment["verdict"] == "accept"
    assert outcome["kind"] == ("snap_applied" if sure else "snap_offered")
    state = admin.get(url).json()
    assert state["snap"]["asked_by"] == "machine"
    assert sure or state["offer"]["quiet"]
    assert (state["assessment"] if sure else state["offer"]["assessment"]) == assessment
    snap = admin.get(f"/api/snaps/{outcome['snap_id']}").json()
    assert snap["estimate"]["assessment"] == assessment
    assert snap["withheld"] == (
        None if sure else f"{assessment['verdict']}: {'; '.join(assessment['reasons'])}"
    )
    assert snap["estimate"]["certificates"]["check"]["pixels"] >= 0


def test_nobody_else_turns_it_on(live: LiveServer, looked: dict[str, Any]) -> None:
    url = f"{url_of(looked)}/live"
    assert "of yours" in sentence(live.script("somebody else").put(url, json={"on": False}), 404)
    sentence(live.stranger().put(url, json={"on": False}), 401)
