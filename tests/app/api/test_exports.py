"""Exports: from the request to the archive, and what can go wrong on the way."""

import hashlib
import io
import json
import zipfile
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from app.export.processes import INTERRUPTED
from app.main import create_services
from app.storage.roles import Role
from app.storage.tables import Export
from registration_core.geometry import pose
from tests.app.conftest import settings_for
from tests.app.live import LiveServer, running_server
from tests.app.rest import begin, sentence
from tests.app.small_dataset import NEAR_VIEW, POSED_SCENE, TOOL, true_pose
from tests.app.waiting import wait_until

TASKS = 4


def submit_all(client: httpx.Client) -> None:
    """Register every task at its true pose."""
    for index in range(TASKS):
        registration = begin(client, index)
        task = client.get(f"/api/tasks/{registration['task_id']}").json()
        T = true_pose(task["object"]["obj_id"], posed=task["scene"]["label"] == "scene 1")
        url = f"/api/registrations/{registration['id']}"
        assert client.put(f"{url}/pose", json={"T_world_object": T.tolist()}).status_code == 200
        assert client.post(f"{url}/submit").status_code == 200


def finished_export(client: httpx.Client, dataset_id: int = 1) -> dict[str, Any]:
    """A new export when it has ended."""
    answer = client.post("/api/exports", json={"dataset_id": dataset_id, "format": "bop"})
    assert answer.status_code == 202, answer.text
    export_id = answer.json()["id"]
    seen = []

    def look() -> dict[str, Any] | None:
        export = client.get(f"/api/exports/{export_id}").json()
        seen.append(export)
        return export if export["state"] in {"done", "failed"} else None

    ended = wait_until(look, "the export to end")
    assert {export["state"] for export in seen[:-1]} <= {"queued", "running"}
    shares = [export["progress"] for export in seen]
    assert shares == sorted(shares) and all(0 <= share <= 1 for share in shares)
    assert all(export["download_url"] is None and export["bytes"] is None for export in seen[:-1])
    return ended


@pytest.fixture(scope="module")
def done(server: LiveServer, chief: httpx.Client) -> dict[str, Any]:
    """An export of all true poses."""
    submit_all(server.script("a robot that knows"))
    export = finished_export(chief)
    assert export["state"] == "done", export
    return export


@pytest.fixture(scope="module")
def archive(chief: httpx.Client, done: dict[str, Any]) -> bytes:
    return chief.get(done["download_url"]).content


def test_nothing_submitted_is_said(own_live: LiveServer) -> None:
    chief = own_live.script("chief", Role.ADMIN)
    failed = finished_export(chief)
    assert failed["state"] == "failed"
    assert "submitted" in failed["message"] and "tools" in failed["message"]
    assert failed["download_url"] is None and failed["bytes"] is None
    said = sentence(chief.get(f"/api/exports/{failed['id']}/download"), 409)
    assert f"Export {failed['id']} is failed" in said


def test_a_finished_export_tells_what_it_holds(chief: httpx.Client, done: dict[str, Any]) -> None:
    assert (done["dataset_id"], done["dataset_name"], done["format"]) == (1, "tools", "bop")
    assert done["progress"] == 1.0
    assert "Scenes: 2, images: 3, annotated objects: 4" in done["message"]
    assert chief.get("/api/exports?dataset_id=1").json()["items"] == [done]
    assert chief.get("/api/exports?dataset_id=999").json()["items"] == []


def test_the_archive_holds_the_submitted_poses_and_the_log(archive: bytes) -> None:
    with zipfile.ZipFile(io.BytesIO(archive)) as content:
        assert content.testzip() is None
        names = content.namelist()
        (truths,) = [name for name in names if name.endswith(f"{POSED_SCENE}/scene_gt.json")]
        entries = json.loads(content.read(truths))["0"]
    (tool,) = [entry for entry in entries if entry["obj_id"] == TOOL]
    T_camera_tool = pose.inverse(NEAR_VIEW) @ true_pose(TOOL)
    assert np.allclose(np.reshape(tool["cam_R_m2c"], (3, 3)), T_camera_tool[:3, :3], atol=1e-6)
    assert np.allclose(tool["cam_t_m2c"], 1000 * T_camera_tool[:3, 3], atol=1e-3)
    assert any("interaction_log/" in name for name in names)


def test_the_archive_is_named_by_its_content(
    server: LiveServer, chief: httpx.Client, done: dict[str, Any], archive: bytes
) -> None:
    answer = chief.get(done["download_url"])
    digest = hashlib.sha256(archive).hexdigest()
    assert answer.headers["content-type"] == "application/zip"
    assert f'filename="tools-{digest[:12]}.zip"' in answer.headers["content-disposition"]
    assert answer.headers["etag"] == f'"{digest}"'
    assert int(answer.headers["content-length"]) == len(archive) == done["bytes"]
    assert server.services.files.path(digest).read_bytes() == archive


@pytest.mark.parametrize(
    ("asked", "wanted"),
    [("bytes=0-99", slice(0, 100)), ("bytes=1000-1999", slice(1000, 2000)), ("bytes=-50", slice(-50, None))],
)
def test_a_download_goes_on_where_it_broke_off(
    chief: httpx.Client, done: dict[str, Any], archive: bytes, asked: str, wanted: slice
) -> None:
    answer = chief.get(done["download_url"], headers={"range": asked})
    assert answer.status_code == 206
    assert answer.content == archive[wanted]
    start, stop, _ = wanted.indices(len(archive))
    assert answer.headers["content-range"] == f"bytes {start}-{stop - 1}/{len(archive)}"
    assert answer.headers["accept-ranges"] == "bytes"


def test_a_part_of_another_archive_is_not_mixed_in(
    chief: httpx.Client, done: dict[str, Any], archive: bytes
) -> None:
    url, digest = done["download_url"], hashlib.sha256(archive).hexdigest()
    other = chief.get(url, headers={"range": "bytes=0-99", "if-range": '"another"'})
    assert other.status_code == 200 and other.content == archive
    same = chief.get(url, headers={"range": "bytes=0-99", "if-range": f'"{digest}"'})
    assert same.status_code == 206 and same.content == archive[:100]
    beyond = chief.get(url, headers={"range": f"bytes={len(archive)}-"})
    assert beyond.status_code == 416


def test_bad_requests_name_the_field(chief: httpx.Client) -> None:
    before = chief.get("/api/exports").json()
    for body, words in (
        ({"dataset_id": 999}, "dataset_id 999"),
        ({"dataset_id": 0}, "body.dataset_id"),
        ({}, "body.dataset_id"),
        ({"dataset_id": 1, "format": "yaml"}, "body.format"),
    ):
        assert words in sentence(chief.post("/api/exports", json=body), 422)
    assert chief.get("/api/exports").json() == before
    for url in ("/api/exports/999", "/api/exports/999/download"):
        assert "no export 999" in sentence(chief.get(url), 404)


def test_only_administrators_export(
    server: LiveServer, operator: httpx.Client, reviewer: httpx.Client, done: dict[str, Any]
) -> None:
    url = f"/api/exports/{done['id']}"
    calls = [("POST", "/api/exports"), ("GET", "/api/exports"), ("GET", url), ("GET", f"{url}/download")]
    for method, address in calls:
        body = {"dataset_id": 1} if method == "POST" else None
        for client in (operator, reviewer):
            assert "role admin" in sentence(client.request(method, address, json=body), 403)
        sentence(server.stranger().request(method, address, json=body), 401)


def test_an_export_that_the_server_left_unfinished_has_failed(state_dir: Path, cluster: str) -> None:
    services = create_services(settings_for(state_dir, cluster))
    user = services.auth.ensure_user("chief", Role.ADMIN)
    with services.database.write() as session:
        rows = [
            Export(dataset_id=1, format="bop", user_id=user.id, state=state, message="before")
            for state in ("queued", "running", "done")
        ]
        session.add_all(rows)
    with running_server(services) as restarted:
        found = restarted.script("chief", Role.ADMIN).get("/api/exports").json()["items"]
    told = [(export["state"], export["message"]) for export in found]
    assert told == [("failed", INTERRUPTED), ("failed", INTERRUPTED), ("done", "before")]


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"scene_ids": [10_000]}, "scene 10000 is not of dataset 1"),
        ({"scene_ids": []}, "body.scene_ids"),
        ({"format": "zip"}, "body.format"),
        ({"without": [0]}, "body.without"),
    ],
)
def test_a_part_that_is_none_is_refused(
    chief: httpx.Client, done: dict[str, Any], asked: dict[str, Any], words: str
) -> None:
    answer = chief.post("/api/exports", json={"dataset_id": done["dataset_id"], **asked})
    assert words in sentence(answer, 422)


def test_one_scene_as_poses_alone(chief: httpx.Client, done: dict[str, Any]) -> None:
    scene = chief.get("/api/scenes", params={"dataset_id": done["dataset_id"]}).json()["items"][0]
    asked = {"dataset_id": done["dataset_id"], "format": "csv", "scene_ids": [scene["id"]]}
    export_id = chief.post("/api/exports", json=asked).json()["id"]

    def ended() -> dict[str, Any] | None:
        found = chief.get(f"/api/exports/{export_id}").json()
        return found if found["state"] in {"done", "failed"} else None

    export = wait_until(ended, "the export to end")
    assert (export["state"], export["format"], export["scene_ids"]) == ("done", "csv", [scene["id"]])
    assert export["failures"] == []
    with zipfile.ZipFile(io.BytesIO(chief.get(export["download_url"]).content)) as archive:
        (name,) = archive.namelist()
        rows = archive.read(name).decode().splitlines()
    assert rows[0] == "scene_id,im_id,obj_id,score,R,t,time" and len(rows) > 1
    assert sentence(chief.get(f"/api/exports/{export_id}/failures/1.jpg"), 404)
