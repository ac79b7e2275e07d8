"""Searches by REST on real workers: the same candidates as the library's, and how they end."""

from typing import Any

import httpx
import numpy as np
import pytest

from app.datasets.scene_data import camera_of
from app.storage.roles import Role
from registration_core import SnapConfig, propose
from registration_core.geometry import pose
from tests.app.live import LiveServer
from tests.app.rest import begin, finished_snap, kinds, log_of, sentence
from tests.app.small_dataset import TOOL, true_pose
from tests.app.waiting import wait_until


@pytest.fixture
def url(operator: httpx.Client) -> str:
    return f"/api/registrations/{begin(operator)['id']}"


def finished(client: httpx.Client, search_id: str) -> dict:
    def look() -> dict | None:
        search = client.get(f"/api/searches/{search_id}").json()
        return search if search["state"] not in {"queued", "running"} else None

    return wait_until(look, "the search to end")


def test_a_search_is_the_librarys_and_a_candidate_is_taken(
    server: LiveServer, operator: httpx.Client, url: str
) -> None:
    answer = operator.post(f"{url}/searches", json={"seed": 7})
    assert answer.status_code == 202
    search = finished(operator, answer.json()["id"])
    assert (search["state"], search["seed"], search["region"]) == ("done", 7, None)
    assert operator.get(url).json()["search"] == {"id": search["id"], "state": "done", "message": None}

    live_session = server.live_session(int(url.rsplit("/", 1)[1]))
    frame = live_session.frames[search["frame_id"]]
    depth = server.services.data.depth(frame)
    here = propose(
        live_session.model, depth, camera_of(frame), None, SnapConfig.from_dict({}), np.random.default_rng(7)
    )
    assert [one["weight"] for one in search["candidates"]] == [one.weight for one in here]
    T_camera_object = np.array(search["candidates"][0]["T_camera_object"])
    assert np.array_equal(T_camera_object, here[0].T_camera_object)

    T_world_object = (np.array(frame.T_world_camera) @ T_camera_object).tolist()
    assert operator.put(f"{url}/preview", json={"T_world_object": T_world_object}).json()["preview"]
    body = {"T_world_object": T_world_object, "technique": "proposal", "stems_from": search["id"]}
    state = operator.put(f"{url}/pose", json=body).json()
    assert state["search"] is None and state["preview"] is None
    assert log_of(operator, state["id"])[-1]["detail"] == {
        "technique": "proposal",
        "stems_from": search["id"],
    }
    assert finished(operator, search["id"])["candidates"] == search["candidates"]
    sentence(operator.get(f"/api/snaps/{search['id']}"), 404)


def test_candidates_are_put_away_and_stay_in_the_log(operator: httpx.Client, url: str) -> None:
    search_id = operator.post(f"{url}/searches").json()["id"]
    finished(operator, search_id)
    left = operator.delete(f"/api/searches/{search_id}").json()
    assert left["state"] == "done" and left["candidates"]
    assert operator.get(url).json()["search"] is None


def test_a_search_is_refused_in_one_sentence(operator: httpx.Client, url: str) -> None:
    outside = operator.post(f"{url}/searches", json={"region": [-50, 0, 10, 10]})
    assert "region must overlap the image" in sentence(outside, 422)
    assert "config" in sentence(operator.post(f"{url}/searches", json={"config": {"nonsense": 1}}), 422)
    assert "T_world_object" in sentence(
        operator.put(f"{url}/preview", json={"T_world_object": np.zeros((4, 4)).tolist()}), 422
    )
    sentence(operator.get("/api/searches/unknown"), 404)


def test_searches_are_their_owners(
    server: LiveServer, operator: httpx.Client, reviewer: httpx.Client, url: str
) -> None:
    search_id = operator.post(f"{url}/searches").json()["id"]
    finished(operator, search_id)
    stranger = server.script("somebody else")
    assert reviewer.get(f"/api/searches/{search_id}").status_code == 200
    sentence(stranger.get(f"/api/searches/{search_id}"), 404)
    for path in ("searches", "preview", "uncertainty"):
        method = "POST" if path == "searches" else "PUT"
        body = {"T_world_object": None, "shown": True}
        sentence(stranger.request(method, f"{url}/{path}", json=body), 404)
    sentence(reviewer.delete(f"/api/searches/{search_id}"), 404)
    sentence(server.stranger().post(f"{url}/searches"), 401)


def test_in_manual_nothing_is_looked_for(server: LiveServer) -> None:
    admin = server.script("boss", Role.ADMIN)
    task = admin.get("/api/tasks").json()["items"][0]
    wanted = {"scene_id": task["scene"]["id"], "object_id": task["object"]["id"], "condition": "manual"}
    task_id = admin.post("/api/tasks", json=wanted).json()["id"]
    registration_id = admin.post(f"/api/tasks/{task_id}/registration").json()["id"]
    refused = admin.post(f"/api/registrations/{registration_id}/searches")
    assert "done by hand alone" in sentence(refused, 409)
    assert kinds(admin, registration_id) == ["opened"]


def test_uncertainty_is_told_of_a_snapped_pose_alone_and_after_a_restart(
    server: LiveServer, operator: httpx.Client, url: str
) -> None:
    near = pose.perturbed(true_pose(TOOL), 0.012, np.radians(10), np.random.default_rng(3))
    operator.put(f"{url}/pose", json={"T_world_object": near.tolist()})
    nothing: dict[str, Any] = {"snap_id": None, "translation": None, "rotation": None, "unknown": []}
    assert operator.get(f"{url}/uncertainty").json() == nothing
    snap_id = operator.post(f"{url}/snaps", json={"seed": 1}).json()["id"]
    estimate = finished_snap(operator, snap_id)["estimate"]
    assert estimate["frame_id"] == operator.get(url).json()["frame_id"]
    told = operator.get(f"{url}/uncertainty").json()
    assert told["snap_id"] == snap_id == operator.get(url).json()["estimate_snap_id"]
    assert 0 < told["translation"] < 0.05 and 0 < told["rotation"] <= np.pi
    assert len(told["unknown"]) == len(estimate["ambiguities"])
    assert "has the 3-D view" in sentence(operator.put(f"{url}/uncertainty", json={"shown": False}), 409)
    server.services.live_sessions.close_idle(0.0)
    assert operator.get(f"{url}/uncertainty").json() == told
    operator.post(f"{url}/undo")
    assert operator.get(f"{url}/uncertainty").json() == nothing
