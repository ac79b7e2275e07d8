"""Copying poses by REST: what may be copied by whom, and where the object is then."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from app.datasets.importing import import_dataset
from app.main import create_services
from app.storage.roles import Role
from registration_core.geometry import pose
from tests.app.conftest import settings_for
from tests.app.live import LiveServer, running_server
from tests.app.rest import log_of, put_pose, sentence, shown, url_of
from tests.app.small_dataset import TOOL, UNPOSED_SCENE

FIRST, SECOND = pose.exp([0.1, 0.0, 0.7, 0.2, 0.0, 0.0]), pose.exp([0.0, 0.1, 0.8, 0.0, 0.3, 0.0])


@pytest.fixture(scope="module")
def video(
    demo: Path, imported_state: Path, cluster: str, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[LiveServer]:
    """An application with a dataset whose second scene is a video of three images without camera poses."""
    root = Path(shutil.copytree(demo, tmp_path_factory.mktemp("video") / "video"))
    folder = root / UNPOSED_SCENE
    for image_id in (3, 9):
        for kind in ("depth", "rgb"):
            shutil.copy(folder / f"{kind}/000000.png", folder / f"{kind}/{image_id:06d}.png")
    for name in ("scene_camera.json", "scene_gt.json"):
        content = json.loads((folder / name).read_text())
        (folder / name).write_text(json.dumps(content | {str(i): content["0"] for i in (3, 9)}))
    state_dir = Path(shutil.copytree(imported_state, tmp_path_factory.mktemp("copies") / "state"))
    services = create_services(settings_for(state_dir, cluster))
    import_dataset(services.database, services.files, root)
    with running_server(services) as server:
        yield server


def tasks_of(client: httpx.Client, scene: str) -> list[dict[str, Any]]:
    """Tasks of the video for its first object, in a scene with this in its label."""
    items = client.get("/api/tasks?limit=500").json()["items"]
    return [
        task
        for task in items
        if task["dataset"]["name"] == "video"
        and scene in task["scene"]["label"]
        and task["object"]["obj_id"] == TOOL
    ]


def begin(client: httpx.Client, scene: str, condition: str = "snap") -> dict[str, Any]:
    task = next(task for task in tasks_of(client, scene) if task["condition"] == condition)
    return client.post(f"/api/tasks/{task['id']}/registration").json()


def add_manual_task(chief: httpx.Client, scene: str) -> None:
    task = tasks_of(chief, scene)[0]
    wanted = {"scene_id": task["scene"]["id"], "object_id": task["object"]["id"], "condition": "manual"}
    assert chief.post("/api/tasks", json=wanted).status_code == 201


def copies(client: httpx.Client, registration: dict[str, Any]) -> list[dict[str, Any]]:
    answer = client.get(f"{url_of(registration)}/copies")
    assert answer.status_code == 200, answer.text
    return answer.json()["items"]


def copy(client: httpx.Client, registration: dict[str, Any], source: dict[str, Any]) -> httpx.Response:
    return client.post(f"{url_of(registration)}/copy", json={"registration_id": source["id"]})


def test_my_own_pose_comes_from_the_nearest_frame_in_the_cameras_axes(video: LiveServer) -> None:
    ann = video.script("ann")
    far, near = begin(ann, "frame 9"), begin(ann, "frame 3")
    target = begin(ann, "frame 0")
    assert copies(ann, target) == []  # nobody has posed anything yet
    put_pose(ann, far, FIRST)
    put_pose(ann, near, SECOND)
    found = copies(ann, target)
    assert [item["registration_id"] for item in found] == [near["id"], far["id"]]
    assert all(item["is_mine"] and item["is_neighbour"] for item in found)
    assert found[0]["scene"].endswith("frame 3")
    assert ann.get(found[0]["thumbnail_url"]).headers["content-type"] == "image/jpeg"
    moved = copy(ann, target, far).json()
    assert np.array(moved["T_camera_object"]) == pytest.approx(FIRST)
    event = log_of(ann, target["id"])[-1]
    me = ann.get("/api/me").json()["id"]
    source = {"registration_id": far["id"], "user_id": me}
    assert event["detail"] == {"technique": "copy", "source": source}
    back = ann.post(f"{url_of(target)}/undo")
    assert shown(back) == pytest.approx(np.array(target["T_world_object"]))


def test_another_operators_pose_is_there_once_it_is_submitted(video: LiveServer) -> None:
    bob, cleo, rita = video.script("bob"), video.script("cleo"), video.script("rita", Role.REVIEWER)
    theirs, mine, reviewed = (begin(client, "scene 1") for client in (bob, cleo, rita))
    put_pose(bob, theirs, FIRST)
    assert copies(cleo, mine) == []
    assert "no pose of a registration" in sentence(copy(cleo, mine, theirs), 404)
    assert [item["registration_id"] for item in copies(rita, reviewed)] == [theirs["id"]]
    assert shown(copy(rita, reviewed, theirs)) == pytest.approx(FIRST)
    bob.post(f"{url_of(theirs)}/submit")
    (found,) = copies(cleo, mine)
    assert (found["operator"], found["is_mine"], found["is_neighbour"]) == ("bob", False, False)
    assert (found["state"], found["confidence"]) == ("submitted", None)
    assert shown(copy(cleo, mine, theirs)) == pytest.approx(FIRST)


def test_without_a_machine_everybody_works_alone(video: LiveServer) -> None:
    chief, dan, eve = video.script("chief", Role.ADMIN), video.script("dan"), video.script("eve")
    for scene in ("frame 3", "frame 9"):
        add_manual_task(chief, scene)
    with_machine = begin(dan, "frame 3")
    put_pose(dan, with_machine, FIRST)
    theirs, mine = (begin(client, "frame 9", "manual") for client in (dan, eve))
    put_pose(dan, theirs, SECOND)
    dan.post(f"{url_of(theirs)}/submit")
    assert copies(eve, mine) == []
    neighbour = begin(dan, "frame 3", "manual")
    assert [item["registration_id"] for item in copies(dan, neighbour)] == [theirs["id"]]
    assert copy(dan, neighbour, with_machine).status_code == 404
    reviewed = begin(chief, "frame 9", "manual")
    assert theirs["id"] in {item["registration_id"] for item in copies(chief, reviewed)}


def test_nothing_is_copied_for_strangers_or_into_what_is_done(video: LiveServer) -> None:
    fay, gus = video.script("fay"), video.script("gus")
    source, target = begin(fay, "frame 3"), begin(fay, "frame 0")
    put_pose(fay, source, FIRST)
    assert gus.get(f"{url_of(target)}/copies").status_code == 404
    assert copy(gus, target, source).status_code == 404
    assert "registration_id" in sentence(copy(fay, target, {"id": 0}), 422)
    fay.post(f"{url_of(target)}/submit")
    assert "submitted" in sentence(copy(fay, target, source), 409)
