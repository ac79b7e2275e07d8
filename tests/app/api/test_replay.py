"""Replays over REST: a log made by a script, its trace, any moment of it, and who may see it."""

import numpy as np
import pytest

from app.storage.roles import Role
from registration_core.geometry import pose
from tests.app.api.test_view_proxy import Operator, refused
from tests.app.rest import begin, sentence
from tests.app.waiting import wait_until


def url_of(registration_id: int) -> str:
    return f"/api/registrations/{registration_id}"


@pytest.fixture(scope="module")
def una(live) -> Operator:
    """An operator who dragged the object, looked around, and submitted."""
    una = Operator(live, "una of the replay")
    start = np.array(una.registration["T_world_object"])
    with una.view() as view:
        wait_until(lambda: "view" in kinds_of(una), "the camera")
        view.drag([start @ una.T_object_gizmo @ pose.exp([0, 0.01 * i, 0, 0, 0, 0]) for i in range(1, 5)])
        wait_until(lambda: "drag" in kinds_of(una), "the drag")
    assert una.http.post(f"{url_of(una.id)}/submit").status_code == 200
    return una


def kinds_of(operator: Operator) -> list[str]:
    return [event["kind"] for event in operator.http.get(f"{url_of(operator.id)}/events").json()["items"]]


def test_the_trace_leads_from_the_start_to_what_was_submitted(una):
    trace = una.http.get(f"{url_of(una.id)}/trace").json()
    assert [event["kind"] for event in trace["events"]] == kinds_of(una)
    assert trace["operator"]["name"] == "una of the replay" and trace["state"] == "submitted"
    assert not trace["is_simulated"]
    assert trace["seconds"] == trace["events"][-1]["end"]
    assert trace["curve"]["translation"][-1] == 0.0
    assert trace["curve"]["translation"][0] == pytest.approx(0.04, abs=1e-4)
    (drag,) = (event for event in trace["events"] if event["kind"] == "drag")
    assert drag["start"] < drag["end"] and drag["dof"] == ["ty"]


def test_any_moment_can_be_shown(una):
    opened = una.http.post(f"{url_of(una.id)}/replay").json()
    assert una.http.get(opened["view_url"]).status_code == 200
    trace = una.http.get(f"{url_of(una.id)}/trace").json()
    first, last = (
        una.http.put(f"{url_of(una.id)}/replay", json={"seconds": t}).json() for t in (0.0, trace["seconds"])
    )
    assert np.allclose(first["T_world_object"], una.registration["T_world_object"])
    submitted = una.http.get(f"{url_of(una.id)}/events").json()["items"][-1]
    assert np.allclose(last["T_world_object"], submitted["T_after"])
    assert last["to_last"] == {"translation": 0.0, "rotation": pytest.approx(0.0, abs=1e-6)}
    assert last["confidence"] is None and last["ghost"] is None


def test_the_view_follows_the_time_and_has_no_handles(una):
    view_url = una.http.post(f"{url_of(una.id)}/replay").json()["view_url"]
    moment = una.http.put(f"{url_of(una.id)}/replay", json={"seconds": 1e6}).json()
    with una.view(f"replay/{una.id}") as view:
        for name in ("disable_axes", "disable_sliders", "disable_rotations"):
            view.wait_for(
                "SceneNodeUpdateMessage",
                lambda m, name=name: m["name"] == "/object" and m["updates"].get(name) is True,
            )
        centre = pose.apply(np.array(moment["T_world_object"]), una.T_object_gizmo[:3, 3])
        view.wait_for(
            "SetPositionMessage",
            lambda m: m["name"] == "/object" and np.allclose(m["position"], centre, atol=1e-5),
        )
    assert view_url == f"/view/replay/{una.id}/"
    assert kinds_of(una)[-1] == "submit"  # looking at a replay leaves no trace


def test_reviewers_see_it_and_other_operators_and_strangers_do_not(live, una):
    reviewer, other = live.person("a reviewer of replays", Role.REVIEWER), Operator(live, "vic of the replay")
    assert reviewer.post(f"{url_of(una.id)}/replay").status_code == 200
    assert reviewer.get(f"/view/replay/{una.id}/").status_code == 200
    for answer in (
        other.http.get(f"{url_of(una.id)}/trace"),
        other.http.post(f"{url_of(una.id)}/replay"),
        other.http.put(f"{url_of(una.id)}/replay", json={"seconds": 0}),
        other.http.get(f"/view/replay/{una.id}/"),
    ):
        assert "no registration" in sentence(answer, 404)
    assert refused(lambda: other.view(f"replay/{una.id}")) == 403
    assert refused(lambda: una.view(f"replay/{una.id}", origin="http://evil.example")) == 403
    assert live.stranger().get(f"/view/replay/{una.id}/").status_code == 401


@pytest.mark.parametrize("seconds", [-1, "NaN", 1e12, "soon"])
def test_a_time_that_is_none_is_refused(una, seconds):
    sentence(una.http.put(f"{url_of(una.id)}/replay", json={"seconds": seconds}), 422)


def test_a_frame_of_another_scene_is_refused(una):
    answer = una.http.put(f"{url_of(una.id)}/replay", json={"seconds": 0, "frame_id": 99999})
    assert "does not belong" in sentence(answer, 404)


def test_a_registration_under_way_is_brought_up_to_now(live):
    client = live.script("wim of the replay")
    registration = begin(client)
    url = url_of(registration["id"])
    client.post(f"{url}/replay")
    T = np.array(registration["T_world_object"]) @ pose.exp([0.1, 0, 0, 0, 0, 0])
    client.put(f"{url}/pose", json={"T_world_object": T.tolist()})
    client.post(f"{url}/replay")
    assert np.allclose(client.put(f"{url}/replay", json={"seconds": 1e6}).json()["T_world_object"], T)


def test_an_idle_replay_is_closed_and_opens_again(live, una):
    replays = live.services.replays
    una.http.post(f"{url_of(una.id)}/replay")
    user_id = una.http.get("/api/me").json()["id"]
    replay = replays.get(una.id, user_id)
    with una.view(f"replay/{una.id}"):
        wait_until(lambda: replay.watchers, "the watcher")
        replays.close_idle(0.0)
        assert replays.get(una.id, user_id) is replay
    wait_until(lambda: replays.close_idle(0.0), "the replay to be closed")
    assert una.http.put(f"{url_of(una.id)}/replay", json={"seconds": 0}).status_code == 200
