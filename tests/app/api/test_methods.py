"""What a snap is computed with: by task, by choice, by request, by condition; with real workers."""

from typing import Any

import httpx
import numpy as np
import pytest

from app.storage.roles import Role
from registration_core.geometry import pose
from tests.app.live import LiveServer
from tests.app.rest import finished_snap, log_of, sentence, url_of
from tests.app.small_dataset import TOOL, true_pose
from tests.app.waiting import wait_until

NEAR = pose.perturbed(true_pose(TOOL), 0.012, np.radians(10), np.random.default_rng(3))
SHORT = {"particle_filter": {"iterations": 20, "particles": 40}}


@pytest.fixture(scope="module")
def lead(live: LiveServer) -> httpx.Client:
    return live.script("a lead of methods", Role.ADMIN)


def begin_task(lead: httpx.Client, **wanted: str) -> dict[str, Any]:
    """A registration of a new task."""
    task = lead.get("/api/tasks").json()["items"][0]
    body = {"scene_id": task["scene"]["id"], "object_id": task["object"]["id"], **wanted}
    answer = lead.post("/api/tasks", json=body)
    assert answer.status_code == 201, answer.text
    return lead.post(f"/api/tasks/{answer.json()['id']}/registration").json()


def begin_near(lead: httpx.Client, **wanted: str) -> dict[str, Any]:
    """The same, with the object near the truth."""
    registration = begin_task(lead, **wanted)
    return lead.put(f"{url_of(registration)}/pose", json={"T_world_object": NEAR.tolist()}).json()


def snapped(lead: httpx.Client, registration: dict[str, Any], **body: Any) -> dict[str, Any]:
    answer = lead.post(f"{url_of(registration)}/snaps", json={"seed": 3, **body})
    assert answer.status_code == 202, answer.text
    snap = finished_snap(lead, answer.json()["id"])
    assert snap["state"] == "done", snap
    return snap


def test_snap_is_fast_where_nothing_else_is_said(lead: httpx.Client) -> None:
    registration = begin_near(lead)
    assert (registration["method"], registration["methods"]) == ("default", ["default", "paper"])
    assert snapped(lead, registration)["estimate"]["method"] == "default"


def test_a_task_says_what_its_snaps_are_computed_with(lead: httpx.Client) -> None:
    registration = begin_near(lead, method="paper")
    assert (registration["method"], registration["methods"]) == ("paper", ["paper", "default"])
    assert lead.get(f"/api/tasks/{registration['task_id']}").json()["method"] == "paper"
    estimate = snapped(lead, registration, config=SHORT)["estimate"]
    assert (estimate["method"], estimate["config"]["method"]) == ("paper", "particle_filter")
    assert lead.get(url_of(registration)).json()["snap"]["method"] == "paper"
    fast = snapped(lead, registration, config={"preset": "default"})["estimate"]
    assert fast["method"] == "default"


def test_the_operator_chooses_another_method(lead: httpx.Client) -> None:
    registration = begin_near(lead)
    chosen = lead.put(f"{url_of(registration)}/method", json={"method": "paper"}).json()
    assert chosen["method"] == "paper"
    assert snapped(lead, registration, config=SHORT)["estimate"]["method"] == "paper"
    trace = lead.get(f"{url_of(registration)}/trace").json()
    methods = {event["kind"]: event["method"] for event in trace["events"]}
    assert methods["snap_requested"] == methods["snap_applied"] == "paper"
    assert methods["opened"] is None


def test_a_whole_filter_tells_how_far_it_is_and_can_be_cancelled(lead: httpx.Client) -> None:
    registration = begin_near(lead, method="paper")
    snap_id = lead.post(f"{url_of(registration)}/snaps", json={}).json()["id"]

    def progress() -> float:
        return lead.get(f"/api/snaps/{snap_id}").json()["progress"]

    wait_until(lambda: 0.0 < progress() < 1.0, "the filter to tell how far it is")
    assert lead.delete(f"/api/snaps/{snap_id}").json()["state"] == "cancelled"
    assert log_of(lead, registration["id"])[-1]["kind"] == "snap_cancelled"


@pytest.mark.parametrize(
    ("condition", "other"), [("paper snap", "default"), ("live snap", "paper"), ("manual", "paper")]
)
def test_a_condition_that_fixes_the_method_refuses_another_one(
    lead: httpx.Client, condition: str, other: str
) -> None:
    registration = begin_task(lead, condition=condition)
    assert registration["methods"] == [registration["method"]] != [other]
    url = url_of(registration)
    sentence(lead.put(f"{url}/method", json={"method": other}), 409)
    sentence(lead.post(f"{url}/snaps", json={"config": {"preset": other}}), 409)
    wanted = {"scene_id": 1, "object_id": 1, "condition": condition, "method": other}
    assert f"method '{other}'" in sentence(lead.post("/api/tasks", json=wanted), 422)


def test_the_condition_of_the_papers_snap_has_its_method(lead: httpx.Client) -> None:
    registration = begin_task(lead, condition="paper snap")
    assert "snap" in registration["tools"] and "live snap" not in registration["tools"]
    assert snapped(lead, registration, config=SHORT)["estimate"]["method"] == "paper"


@pytest.mark.parametrize("method", ["magic", "", None])
def test_a_method_that_is_none_is_refused(lead: httpx.Client, method: object) -> None:
    registration = begin_task(lead)
    assert "body.method" in sentence(lead.put(f"{url_of(registration)}/method", json={"method": method}), 422)
