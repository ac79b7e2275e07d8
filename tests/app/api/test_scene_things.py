"""What else is in the scene, over REST."""

from datetime import UTC, datetime

import numpy as np
import pytest

from tests.app.live import LiveServer
from tests.app.rest import begin, kinds, sentence
from tests.app.small_dataset import BLOCK, true_pose


def test_things_of_the_scene_and_whether_they_are_shown(own_live: LiveServer) -> None:
    ann = own_live.script("ann")
    tool, block = begin(ann, 0), begin(ann, 1)
    url = f"/api/registrations/{block['id']}"
    ann.put(f"{url}/pose", json={"T_world_object": true_pose(BLOCK).tolist()})
    ann.post(f"{url}/submit")
    things = f"/api/registrations/{tool['id']}/things"
    own, other = ann.get(things).json()["items"]
    assert (own["task_id"], own["is_current"], own["state"]) == (tool["task_id"], True, "open")
    assert (other["name"], other["state"], other["registration_id"]) == ("block", "submitted", block["id"])
    assert np.allclose(other["T_world_object"], true_pose(BLOCK))
    assert own["color"] != other["color"]
    assert ann.put(things, json={"on": False}).status_code == 204
    assert ann.get(things).json()["items"] == [own, other]
    assert "body.on" in sentence(ann.put(things, json={}), 422)
    assert "of yours" in sentence(own_live.script("bob").get(things), 404)


def test_the_newest_pose_of_others_is_told_also_where_the_clock_was_put_back(
    own_live: LiveServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    carol = own_live.script("carol")
    things = f"/api/registrations/{begin(carol, 0)['id']}/things"
    for name, hour in (("ann", 13), ("bob", 12), ("dan", 12)):
        registration = begin(own_live.script(name), 1)
        now = datetime(2026, 3, 4, hour, tzinfo=UTC)
        monkeypatch.setattr(own_live.services.log.clock, "utc", lambda now=now: now)
        assert own_live.clients[-1].post(f"/api/registrations/{registration['id']}/submit").status_code == 200
        assert carol.get(things).json()["items"][1]["registration_id"] == registration["id"]


def test_skipping_and_reopening(own_live: LiveServer) -> None:
    ann, bob = own_live.script("ann"), own_live.script("bob")
    mine = begin(ann, 0)
    url = f"/api/registrations/{mine['id']}"
    assert "body.reason" in sentence(ann.post(f"{url}/skip", json={"reason": "tired"}), 422)
    skipped = ann.post(f"{url}/skip", json={"reason": "ambiguous"}).json()
    assert (skipped["state"], skipped["skip_reason"]) == ("skipped", "ambiguous")
    assert "was skipped" in sentence(ann.post(f"{url}/undo"), 409)
    (task,) = ann.get("/api/tasks?state=skipped").json()["items"]
    ended = {
        "name": "ann",
        "state": "skipped",
        "skip_reason": "ambiguous",
        "registration_id": mine["id"],
        "is_here": False,
        "assessment": None,
    }
    assert task["operators"] == [ended]
    for client in (ann, bob):
        assert client.get("/api/tasks/next").json()["id"] != task["id"]
    assert sentence(bob.post(f"{url}/reopen"), 404)
    reopened = ann.post(f"{url}/reopen").json()
    assert (reopened["state"], reopened["skip_reason"]) == ("open", None)
    assert ann.get("/api/tasks/next").json()["id"] == task["id"]
    assert "is open" in sentence(ann.post(f"{url}/reopen"), 409)
    assert kinds(ann, mine["id"]) == ["opened", "skip", "reopen"]
    ann.post(f"{url}/skip", json={"reason": "no depth"})
    begin(bob, 0)
    assert ann.get("/api/tasks?state=skipped").json()["items"] == []
    assert [t["id"] for t in ann.get("/api/tasks?state=in_progress").json()["items"]] == [task["id"]]
