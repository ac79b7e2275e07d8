"""The symmetries of an object over REST: who may decide, what is refused, and what follows a decision."""

import json
from itertools import combinations
from typing import Any

import httpx
import numpy as np
import pytest

from app.storage.roles import Role
from registration_core.geometry import pose
from tests.app.live import LiveServer
from tests.app.rest import begin, finished_snap, put_pose, sentence
from tests.app.small_dataset import BLOCK, TOOL, true_pose

UP = {"axis": [0, 0, 1], "point": [0, 0, 0], "fold": 2}


def object_of(client: httpx.Client, obj_id: int) -> dict[str, Any]:
    items = client.get("/api/objects?dataset_id=1").json()["items"]
    (found,) = [item["id"] for item in items if item["obj_id"] == obj_id]
    return client.get(f"/api/objects/{found}").json()


def put(client: httpx.Client, item: dict[str, Any], body: object) -> httpx.Response:
    # written by json, since httpx refuses to send the NaN that Python's json reads
    content, headers = json.dumps(body), {"content-type": "application/json"}
    return client.put(f"/api/objects/{item['id']}/symmetries", content=content, headers=headers)


def decided(client: httpx.Client, item: dict[str, Any], body: object) -> dict[str, Any]:
    answer = put(client, item, body)
    assert answer.status_code == 200, answer.text
    return answer.json()


@pytest.fixture
def block(own_live: LiveServer) -> dict[str, Any]:
    """As it was imported."""
    return object_of(own_live.script("looker"), BLOCK)


def test_an_object_tells_its_size_and_suggestions(operator: httpx.Client) -> None:
    block, tool = object_of(operator, BLOCK), object_of(operator, TOOL)
    assert block["size"] == pytest.approx([0.04, 0.06, 0.06]) and block["diameter"] > 0.09
    assert [entry["fold"] for entry in block["suggestions"]] == [4, 2, 2, 2, 2]
    assert all(0 <= entry["residual"] < 1e-4 for entry in block["suggestions"])
    assert (block["symmetries_version"], block["axes"], block["undo_version"]) == (1, [], None)
    assert block["suggestions_open"] and not tool["suggestions_open"] and tool["suggestions"] == []


def test_open_suggestions_are_easy_to_find(own_live: LiveServer, block: dict[str, Any]) -> None:
    lead = own_live.person("lea", Role.ADMIN)
    url = "/api/objects?suggestions_open=true"
    assert [item["id"] for item in lead.get(url).json()["items"]] == [block["id"]]
    assert lead.get("/api/datasets/1").json()["suggestions_open"] == 1
    assert not decided(lead, block, {"axes": []})["suggestions_open"]
    assert lead.get(url).json()["items"] == []
    assert lead.get("/api/datasets/1").json()["suggestions_open"] == 0


def test_only_a_lead_decides_and_everybody_may_look(own_live: LiveServer, block: dict[str, Any]) -> None:
    url = f"/api/objects/{block['id']}/symmetries"
    for name, role in (("olga", Role.OPERATOR), ("rita", Role.REVIEWER)):
        client = own_live.person(name, role)
        assert "needs the role admin" in sentence(put(client, block, {"axes": []}), 403)
        (version,) = client.get(url).json()
        assert (version["version"], version["user"]) == (1, None)
        residual = client.post(f"/api/objects/{block['id']}/residual", json=block["suggestions"][0]).json()
        assert residual["residual"] == pytest.approx(block["suggestions"][0]["residual"], abs=1e-6)


def test_decisions_are_versions_that_can_be_taken_back(own_live: LiveServer, block: dict[str, Any]) -> None:
    lead = own_live.person("lea", Role.ADMIN)
    accepted = decided(lead, block, {"axes": block["suggestions"][:2], "version": 1})
    assert (accepted["symmetries_version"], accepted["undo_version"]) == (2, 1)
    assert len(accepted["symmetries"]["discrete"]) == 7
    assert [axis["fold"] for axis in accepted["axes"]] == [4, 2]
    back = decided(lead, block, {"restore": accepted["undo_version"], "version": 2})
    assert back["symmetries"] == block["symmetries"] and back["suggestions_open"]
    versions = lead.get(f"/api/objects/{block['id']}/symmetries").json()
    assert [(v["version"], v["restores"]) for v in versions] == [(3, 1), (2, None), (1, None)]
    assert [v["user"] and v["user"]["name"] for v in versions] == ["lea", "lea", None]
    late = put(lead, block, {"axes": [], "version": 1})
    assert "version 3 is the present one, not 1" in sentence(late, 409)


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ({}, "body: Send either axes, an empty list for none, or the version to restore"),
        ({"axes": [], "restore": 1}, "body: Send either axes"),
        ({"restore": 7}, "body.restore: there is no version 7"),
        ({"restore": 0}, "body.restore: Input should be greater than or equal to 1"),
        ({"axes": [UP | {"axis": [0, 0, 0]}]}, "body.axes[0].axis: The direction (0, 0, 0) is none"),
        ({"axes": [UP | {"axis": [0, 1]}]}, "body.axes.0.axis.2: Field required"),
        ({"axes": [UP | {"axis": [0, 0, float("nan")]}]}, "body.axes.0.axis.2: Input should be"),
        ({"axes": [UP | {"point": [float("inf"), 0, 0]}]}, "body.axes.0.point.0: Input should be"),
        ({"axes": [UP | {"point": [60, 0, 0]}]}, "body.axes[0] passes 6e+04 mm from the middle"),
        ({"axes": [UP | {"fold": 0}]}, "body.axes.0.fold: Input should be greater than or equal to 2"),
        ({"axes": [UP | {"fold": 1}]}, "body.axes.0.fold: Input should be greater than or equal to 2"),
        ({"axes": [UP | {"fold": 1000}]}, "body.axes.0.fold: Input should be less than or equal to 24"),
        ({"axes": [UP | {"fold": 2.5}]}, "body.axes.0.fold: Input should be a valid integer"),
        ({"axes": [{"axis": [0, 0, 1]}]}, "body.axes.0.fold: Field required"),
        ({"axes": [UP, UP | {"fold": None}]}, "body.axes[0] and axes[1] have one direction"),
        (
            {"axes": [UP | {"fold": 5}, {"axis": [0, 0.644, 0.765], "fold": 7}]},
            "body.axes contradict each other",
        ),
        ({"axes": [UP] * 40}, "body.axes: List should have at most 31 items"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(
    server: LiveServer, chief: httpx.Client, body: dict[str, Any], message: str
) -> None:
    block = object_of(chief, BLOCK)
    assert message in sentence(put(chief, block, body), 422)
    assert object_of(chief, BLOCK) == block


def test_tiny_and_huge_directions_are_directions(own_live: LiveServer, block: dict[str, Any]) -> None:
    lead = own_live.person("lea", Role.ADMIN)
    for length in (1e-300, 1e8):
        (axis,) = decided(lead, block, {"axes": [UP | {"axis": [0, 0, length]}]})["axes"]
        assert axis["axis"] == [0, 0, 1]


def test_the_next_snap_of_an_open_session_uses_what_was_decided(
    own_live: LiveServer, block: dict[str, Any]
) -> None:
    lead, robot = own_live.person("lea", Role.ADMIN), own_live.script("robot")
    registration = begin(robot, task=1)
    url = f"/api/registrations/{registration['id']}"
    assert registration["symmetries_version"] == 1

    def snapped() -> dict[str, Any]:
        put_pose(robot, registration, true_pose(BLOCK) @ pose.exp([0, 0, 0, np.pi / 4, 0, 0]))
        order = {"seed": 3, "start_spread": [0.02, 1.0]}  # half-way between twins
        snap = finished_snap(robot, robot.post(f"{url}/snaps", json=order).json()["id"])
        assert snap["state"] == "done", snap
        return snap["estimate"]

    before = snapped()
    item = decided(lead, block, {"axes": block["suggestions"][:2]})
    told = robot.get(url).json()
    assert told["symmetries_version"] == 2 and told["revision"] > registration["revision"]
    after = snapped()
    assert (before["symmetries_version"], after["symmetries_version"]) == (1, 2)
    twins = np.array(item["symmetries"]["discrete"])[:, :3, :3]
    assert twin_pairs(before, twins) > 0
    assert twin_pairs(after, twins) == 0


def twin_pairs(estimate: dict[str, Any], twins: np.ndarray) -> int:
    """How many pairs of an estimate's poses a symmetry takes to each other, to 10 degrees and 3 mm."""
    poses = [np.array(one["T_camera_object"]) for one in estimate["hypotheses"]]
    count = 0
    for one, other in combinations(poses, 2):
        cosine = (np.einsum("ij,kij->k", one[:3, :3].T @ other[:3, :3], twins).max() - 1.0) / 2.0
        apart = np.linalg.norm(one[:3, 3] - other[:3, 3])  # the symmetries leave the origin where it is
        count += bool(cosine > np.cos(np.radians(10.0)) and apart < 0.003)
    return count
