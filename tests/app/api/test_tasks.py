"""Tasks: finding them, taking the next one, asking for more."""

import io
from pathlib import Path

import httpx
import pytest
from PIL import Image
from sqlalchemy import select

from app.analysis.study_data.runs import TASK_PARTS, place_name
from app.datasets.importing import import_dataset
from app.storage.roles import Role
from app.storage.tables import Task
from tests.app.live import LiveServer
from tests.app.rest import begin, sentence


def items(client: httpx.Client, **query: int | str) -> list[dict]:
    return client.get("/api/tasks", params=query).json()["items"]


def ids(client: httpx.Client, **query: int | str) -> list[int]:
    return [task["id"] for task in items(client, **query)]


def submit(client: httpx.Client, registration_id: int) -> None:
    assert client.post(f"/api/registrations/{registration_id}/submit").status_code == 200


@pytest.fixture(scope="module", autouse=True)
def other_dataset(server: LiveServer, demo: Path) -> int:
    """A second dataset with four more tasks."""
    return import_dataset(server.services.database, server.services.files, demo, "others").dataset_id


def test_a_task_tells_what_is_asked_for(operator: httpx.Client) -> None:
    first = items(operator)[0]
    assert first["dataset"] == {"id": 1, "name": "tools"}
    assert first["scene"]["label"] == "scene 1"
    assert (first["object"]["obj_id"], first["object"]["name"]) == (3, "angle tool")
    assert (first["mode"], first["condition"], first["instance"]) == ("accurate", "snap", 0)
    assert (first["state"], first["operators"], first["mine"]) == ("open", [], None)
    assert operator.get(f"/api/tasks/{first['id']}").json() == first
    scene = operator.get(f"/api/scenes/{first['scene']['id']}").json()
    assert first["frame_id"] == scene["frames"][0]["id"]


def test_pages_together_are_the_list(operator: httpx.Client) -> None:
    everything = ids(operator)
    assert len(everything) == 8
    seen, after = [], 0
    while after is not None:
        page = operator.get("/api/tasks", params={"limit": 3, "after": after}).json()
        assert len(page["items"]) <= 3
        seen += [task["id"] for task in page["items"]]
        after = page["next"]
    assert seen == everything


def test_filters_by_dataset_and_scene(operator: httpx.Client, other_dataset: int) -> None:
    assert ids(operator, dataset_id=1) + ids(operator, dataset_id=other_dataset) == ids(operator)
    scenes = [scene["id"] for scene in operator.get("/api/scenes").json()["items"]]
    for scene_id in scenes:
        found = items(operator, scene_id=scene_id)
        assert len(found) == 2
        assert {task["scene"]["id"] for task in found} == {scene_id}
    assert ids(operator, dataset_id=other_dataset, scene_id=scenes[0]) == []
    assert ids(operator, dataset_id=999) == []


@pytest.mark.parametrize(
    ("query", "field"),
    [
        ("state=finished", "state"),
        ("limit=0", "limit"),
        ("limit=501", "limit"),
        ("after=-1", "after"),
        (f"after={10**30}", "after"),
        ("dataset_id=x", "dataset_id"),
        (f"scene_id={10**12}", "scene_id"),
    ],
)
def test_a_bad_query_names_its_field(operator: httpx.Client, query: str, field: str) -> None:
    assert f"query.{field}: " in sentence(operator.get(f"/api/tasks?{query}"), 422)


def test_states_tell_who_has_a_task(own_live: LiveServer) -> None:
    ann, bob = own_live.script("ann"), own_live.script("bob")
    first, second, *rest = ids(ann)
    mine = begin(ann, 0)
    submit(ann, mine["id"])
    begin(bob, 0)
    begin(bob, 1)
    assert ids(ann, state="submitted") == [first]
    assert ids(ann, state="in_progress") == [second]
    assert ids(ann, state="open") == rest
    task = ann.get(f"/api/tasks/{first}").json()
    assert task["state"] == "submitted"
    assert task["mine"] == mine["id"]
    assert [(o["name"], o["state"]) for o in task["operators"]] == [("ann", "submitted"), ("bob", "open")]


def test_the_next_task_is_mine_or_nobodys(own_live: LiveServer) -> None:
    def next_of(client: httpx.Client) -> int:
        return client.get("/api/tasks/next").json()["id"]

    ann, bob = own_live.script("ann"), own_live.script("bob")
    first, second, third, fourth = ids(ann)
    assert next_of(ann) == first
    mine = begin(ann, 2)
    assert next_of(ann) == third
    assert next_of(bob) == first
    submit(ann, mine["id"])
    assert next_of(ann) == first
    begin(bob, 0)
    assert next_of(ann) == second
    for task in (1, 3):
        submit(ann, begin(ann, task)["id"])
    assert next_of(bob) == first
    assert "All tasks" in sentence(ann.get("/api/tasks/next"), 404)
    assert fourth in ids(ann, state="submitted")


def test_the_next_task_stays_among_those_that_are_asked_for(own_live: LiveServer, demo: Path) -> None:
    services = own_live.services
    other = import_dataset(services.database, services.files, demo, "others").dataset_id
    ann, bob = own_live.script("ann"), own_live.script("bob")

    def next_of(client: httpx.Client, **query: int | str) -> int:
        return client.get("/api/tasks/next", params=query).json()["id"]

    there = ids(ann, dataset_id=other)
    assert next_of(ann) < next_of(ann, dataset_id=other) == there[0]
    scene_id = items(ann, dataset_id=other)[-1]["scene"]["id"]
    assert next_of(ann, scene_id=scene_id) == ids(ann, scene_id=scene_id)[0]

    submit(bob, begin(bob, 0)["id"])
    assert next_of(ann, state="submitted") == ids(ann)[0]  # I have not begun it
    submit(ann, begin(ann, 0)["id"])
    assert "All tasks" in sentence(ann.get("/api/tasks/next", params={"state": "submitted"}), 404)


def test_an_administrator_asks_for_more(own_live: LiveServer) -> None:
    chief = own_live.script("chief", Role.ADMIN)
    task = items(chief)[0]
    wanted = {"scene_id": task["scene"]["id"], "object_id": task["object"]["id"]}
    before = ids(chief)
    answer = chief.post("/api/tasks", json=wanted)
    assert answer.status_code == 201
    assert (answer.json()["mode"], answer.json()["condition"]) == ("accurate", "snap")
    assert (answer.json()["instance"], answer.json()["instances"]) == (1, 2)
    other = chief.post("/api/tasks", json={**wanted, "mode": "quick", "condition": "manual"}).json()
    assert (other["mode"], other["condition"]) == ("quick", "manual")
    assert (other["instance"], other["instances"]) == (0, 2)  # the same two, whatever is asked of them
    assert ids(chief, mode="quick") == ids(chief, condition="manual") == [other["id"]]
    assert ids(chief, mode="quick", condition="snap") == []
    assert chief.get("/api/tasks/next", params={"mode": "quick"}).json()["id"] == other["id"]
    dataset = chief.get(f"/api/datasets/{task['dataset']['id']}").json()
    assert (dataset["modes"], dataset["conditions"]) == (["accurate", "quick"], ["manual", "snap"])
    assert ids(chief) == [*before, answer.json()["id"], other["id"]]
    started = chief.post(f"/api/tasks/{other['id']}/registration")
    assert started.status_code == 200
    assert started.json()["task_id"] == other["id"]


def test_a_thing_has_one_name_everywhere(own_live: LiveServer) -> None:
    chief = own_live.script("who asks for names", Role.ADMIN)
    task = items(chief)[1]
    wanted = {"scene_id": task["scene"]["id"], "object_id": task["object"]["id"]}
    second, quick = (
        chief.post("/api/tasks", json={**wanted, **more}).json() for more in ({}, {"mode": "quick"})
    )
    names = [chief.get(f"/api/tasks/{one['id']}").json()["name"] for one in (task, second, quick)]
    assert names == ["block #1", "block #2", "block #1"]
    begun = chief.post(f"/api/tasks/{second['id']}/registration").json()
    things = chief.get(f"/api/registrations/{begun['id']}/things").json()["items"]
    assert {"block #1", "block #2"} <= {thing["name"] for thing in things}
    with own_live.services.database.read() as session:
        rows = session.scalars(
            select(Task).where(Task.id.in_([task["id"], second["id"], quick["id"]])).options(*TASK_PARTS)
        )
        assert [place_name(row).rsplit(", ", 1)[1] for row in rows] == names


def test_a_task_for_what_does_not_exist_is_refused(
    chief: httpx.Client, operator: httpx.Client, other_dataset: int
) -> None:
    scene = operator.get("/api/scenes?dataset_id=1").json()["items"][0]["id"]
    item = operator.get("/api/objects?dataset_id=1").json()["items"][0]["id"]
    foreign = operator.get(f"/api/objects?dataset_id={other_dataset}").json()["items"][0]["id"]
    before = ids(operator)
    for body, words in (
        ({"scene_id": 999, "object_id": item}, "scene_id 999"),
        ({"scene_id": scene, "object_id": 999}, "object_id 999"),
        ({"scene_id": scene, "object_id": foreign}, f"object_id {foreign}"),
        ({"scene_id": scene}, "body.object_id"),
        ({"scene_id": 0, "object_id": item}, "body.scene_id"),
        ({"scene_id": 2**31, "object_id": item}, "body.scene_id"),
        ({"scene_id": scene, "object_id": item, "mode": "slow"}, "body.mode"),
        ({"scene_id": scene, "object_id": item, "condition": "magic"}, "body.condition"),
    ):
        assert words in sentence(chief.post("/api/tasks", json=body), 422)
    assert ids(operator) == before


def test_only_administrators_ask_for_tasks(
    server: LiveServer, operator: httpx.Client, reviewer: httpx.Client
) -> None:
    body = {"scene_id": 1, "object_id": 1}
    for client in (operator, reviewer):
        assert "role admin" in sentence(client.post("/api/tasks", json=body), 403)
    sentence(server.stranger().post("/api/tasks", json=body), 401)
    assert len(ids(operator)) == 8


def test_a_thumbnail_is_a_small_jpeg(operator: httpx.Client) -> None:
    pictures = set()
    for task in items(operator, dataset_id=1):
        answer = operator.get(task["thumbnail_url"])
        assert answer.headers["content-type"] == "image/jpeg"
        with Image.open(io.BytesIO(answer.content)) as image:
            image.load()
            assert (image.format, image.size) == ("JPEG", (320, 240))
        assert len(answer.content) < 50_000
        pictures.add(answer.content)
    assert len(pictures) == 2  # both scenes show the same view, each with both objects


@pytest.mark.parametrize("url", ["tasks/999", "tasks/999/thumbnail.jpg"])
def test_an_unknown_task_is_said(operator: httpx.Client, url: str) -> None:
    assert "no task 999" in sentence(operator.get(f"/api/{url}"), 404)
    assert "no task 999" in sentence(operator.post("/api/tasks/999/registration"), 404)
