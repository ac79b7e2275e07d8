"""Datasets: how far their work is, and taking one in from a zip file, whole or not at all."""

import io
import threading
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import httpx
import pytest
import trimesh
from sqlalchemy import text

from app.storage.roles import Role
from tests.app.live import LiveServer
from tests.app.rest import begin, sentence
from tests.app.small_dataset import POSED_SCENE, UNPOSED_SCENE, change_json
from tests.app.waiting import LONGEST, wait_until

TABLES = ("datasets", "objects", "scenes", "frames", "tasks")
MEGABYTE = 2**20


def packed(folder: Path, prefix: str = "") -> bytes:
    """A zip file with the content of a folder."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(folder.rglob("*")):
            archive.write(path, prefix + str(path.relative_to(folder)))
    return content.getvalue()


def packed_entries(*entries: tuple[str | zipfile.ZipInfo, bytes]) -> bytes:
    """A zip file with these entries."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in entries:
            archive.writestr(name, data)
    return content.getvalue()


def upload(client: httpx.Client, content: bytes, name: str = "tools.zip") -> httpx.Response:
    return client.post("/api/datasets", files={"file": (name, content, "application/zip")})


def rows_of(server: LiveServer) -> dict[str, Sequence[Any]]:
    with server.services.database.read() as session:
        return {table: session.execute(text(f"SELECT * FROM {table} ORDER BY id")).all() for table in TABLES}


def files_of(server: LiveServer) -> set[Path]:
    """All files of the state directory, but for what workers build of objects and for those that SQLite keeps
    beside its own.
    """
    settings = server.services.settings
    return {
        path
        for path in settings.state_dir.rglob("*")
        if not path.name.startswith("snap6d.sqlite") and settings.prepared_dir not in (path, path.parent)
    }


def test_a_dataset_tells_how_far_its_work_is(own_live: LiveServer) -> None:
    script = own_live.script("robot")
    (dataset,) = script.get("/api/datasets").json()["items"]
    assert dataset["name"] == "tools"
    counts = {key: dataset[key] for key in ("objects", "scenes", "tasks", "tasks_submitted")}
    assert counts == {"objects": 2, "scenes": 2, "tasks": 4, "tasks_submitted": 0}
    for name in ("robot", "other robot"):
        client = own_live.script(name)
        client.post(f"/api/registrations/{begin(client)['id']}/submit")
    submitted = script.get(f"/api/datasets/{dataset['id']}").json()["tasks_submitted"]
    assert submitted == 1  # a task that two people did is one task


def test_it_is_told_when_snaps_know_the_objects_of_an_upload(
    server: LiveServer, chief: httpx.Client, demo: Path
) -> None:
    dataset = upload(chief, packed(demo, "prepared/"), "prepared.zip").json()
    assert dataset["problems"] == [] and dataset["objects_prepared"] <= dataset["objects"] == 2

    def prepared() -> bool:
        return chief.get(f"/api/datasets/{dataset['id']}").json()["objects_prepared"] == 2

    wait_until(prepared, "the objects to be prepared")


def test_an_unknown_dataset_is_said(operator: httpx.Client) -> None:
    assert sentence(operator.get("/api/datasets/999"), 404) == "There is no dataset 999."
    assert "dataset_id" in sentence(operator.get("/api/datasets/0"), 422)


@pytest.mark.parametrize(("prefix", "name"), [("", "workshop"), ("bench/", "bench")])
def test_an_upload_is_taken_in_once(
    server: LiveServer, chief: httpx.Client, demo: Path, prefix: str, name: str
) -> None:
    content = packed(demo, prefix)
    answer = upload(chief, content, "workshop.zip")
    assert answer.status_code == 201
    dataset = answer.json()
    assert (dataset["name"], dataset["objects"], dataset["scenes"], dataset["tasks"]) == (name, 2, 2, 4)
    assert dataset["id"] in [item["id"] for item in chief.get("/api/datasets").json()["items"]]
    frame = chief.get(f"/api/scenes?dataset_id={dataset['id']}").json()["items"][0]["frames"][0]
    assert chief.get(frame["depth_url"]).content == (demo / POSED_SCENE / "depth/000000.png").read_bytes()
    rows, files = rows_of(server), files_of(server)
    assert upload(chief, content, "workshop.zip").json() == dataset
    assert rows_of(server) == rows
    assert files_of(server) == files


def test_other_content_under_a_known_name_is_refused(
    server: LiveServer, chief: httpx.Client, demo_copy: Path
) -> None:
    change_json(demo_copy / POSED_SCENE / "scene_camera.json", lambda c: c["0"].update(depth_scale=0.2))
    rows = rows_of(server)
    said = sentence(upload(chief, packed(demo_copy)), 422)
    assert "'tools' was imported before" in said and "image 0 of scene 1" in said
    assert rows_of(server) == rows


# -- uploads that are no sound archive


def symlink() -> bytes:
    entry = zipfile.ZipInfo("models")
    entry.external_attr = 0o120777 << 16
    return packed_entries((entry, b"/etc"))


def damaged(demo: Path) -> bytes:
    """An archive of which the middle of the packed data was overwritten."""
    content = bytearray(packed(demo))
    content[len(content) // 2 : len(content) // 2 + 64] = b"\xff" * 64
    return bytes(content)


def encrypted() -> bytes:
    content = bytearray(packed_entries(("test/a.txt", b"secret")))
    content[6] |= 1  # the flag in the entry's own header
    content[content.index(b"PK\x01\x02") + 8] |= 1  # and in the directory at the end
    return bytes(content)


BAD_ARCHIVES: dict[str, tuple[Callable[[Path], bytes], int, str]] = {
    "no zip": (lambda demo: b"this is no zip file", 422, "no readable zip file"),
    "nothing": (lambda demo: b"", 422, "no readable zip file"),
    "cut off": (lambda demo: packed(demo)[:-1000], 422, "no readable zip file"),
    "damaged": (damaged, 422, "no readable zip file"),
    "encrypted": (lambda demo: encrypted(), 422, "no readable zip file"),
    "empty zip": (lambda demo: packed_entries(), 422, "no mesh"),
    "climbing": (lambda demo: packed_entries(("a/../../evil.txt", b"")), 422, "'a/../../evil.txt' leads out"),
    "climbing back": (lambda demo: packed_entries(("..\\evil.txt", b"")), 422, "leads out of its folder"),
    "absolute": (lambda demo: packed_entries(("/tmp/evil.txt", b"")), 422, "'/tmp/evil.txt' leads out"),
    "drive": (lambda demo: packed_entries(("C:/evil.txt", b"")), 422, "'C:/evil.txt' leads out"),
    "symlink": (lambda demo: symlink(), 422, "'models' leads out of its folder"),
    "only a dot": (lambda demo: packed_entries(("./", b"")), 422, "no mesh"),
    "file and folder": (
        lambda demo: packed_entries(("models", b""), ("models/obj_000001.ply", b"")),
        422,
        "'models/obj_000001.ply'",
    ),
    "name too long": (lambda demo: packed_entries(("n" * 300, b"")), 422, "nnn"),
    "too large": (lambda demo: bytes(8 * MEGABYTE + 1), 413, "larger than 8 MB"),
    "too large unpacked": (
        lambda demo: packed_entries(("bomb", bytes(8 * MEGABYTE + 1))),
        422,
        "more than 8 MB",
    ),
}


@pytest.mark.parametrize("case", BAD_ARCHIVES)
def test_a_bad_archive_is_refused_and_changes_nothing(
    server: LiveServer, chief: httpx.Client, demo: Path, case: str
) -> None:
    make, status, words = BAD_ARCHIVES[case]
    rows, files = rows_of(server), files_of(server)
    assert words in sentence(upload(chief, make(demo), "bad.zip"), status)
    assert rows_of(server) == rows
    assert files_of(server) == files


# -- archives with a dataset that is not sound


def remove(name: str) -> Callable[[Path], object]:
    return lambda root: (root / name).unlink()


def overwrite(name: str, content: bytes) -> Callable[[Path], object]:
    return lambda root: (root / name).write_bytes(content)


def camera(**fields: object) -> Callable[[Path], object]:
    """Change the camera of image 5 of scene 1."""
    return lambda root: change_json(
        root / POSED_SCENE / "scene_camera.json", lambda content: content["5"].update(fields)
    )


def unknown_object(root: Path) -> None:
    change_json(root / UNPOSED_SCENE / "scene_gt.json", lambda content: content["0"][0].update(obj_id=99))


def mesh_in_metres(root: Path) -> None:
    path = root / "models/obj_000003.ply"
    mesh = trimesh.load(path, process=False)
    mesh.apply_scale(0.001)
    mesh.export(path)


BAD_DATASETS: dict[str, tuple[Callable[[Path], object], tuple[str, ...]]] = {
    "missing depth": (remove(f"{POSED_SCENE}/depth/000005.png"), ("000005.png", "missing", "image 5")),
    "broken depth": (overwrite(f"{POSED_SCENE}/depth/000005.png", b"\x89PNG broken"), ("000005.png",)),
    "cam_K of 8": (camera(cam_K=[1.0] * 8), ("scene_camera.json", "image 5", "cam_K", "it has 8")),
    "depth scale 0": (camera(depth_scale=0), ("scene_camera.json", "image 5", "depth_scale", "it is 0")),
    "bad rotation": (
        camera(cam_R_w2c=[2.0, 0, 0, 0, 1, 0, 0, 0, 1]),
        ("scene_camera.json", "image 5", "cam_R_w2c"),
    ),
    "unknown object": (unknown_object, ("scene_gt.json", "obj_id 99", "add models/obj_000099.ply")),
    "broken mesh": (overwrite("models/obj_000007.ply", b"ply broken"), ("obj_000007.ply",)),
    "mesh in metres": (mesh_in_metres, ("obj_000003.ply", "millimetres")),
    "bad JSON": (overwrite(f"{POSED_SCENE}/scene_gt.json", b"{"), ("scene_gt.json", "JSON")),
}


@pytest.mark.parametrize("case", BAD_DATASETS)
def test_a_bad_dataset_is_refused_and_changes_nothing(
    server: LiveServer, chief: httpx.Client, demo_copy: Path, case: str
) -> None:
    spoil, words = BAD_DATASETS[case]
    spoil(demo_copy)
    rows, files = rows_of(server), files_of(server)
    said = sentence(upload(chief, packed(demo_copy), "bad.zip"), 422)
    assert all(word in said for word in words), said
    assert rows_of(server) == rows
    assert files_of(server) == files


def test_only_administrators_may_upload(
    server: LiveServer, operator: httpx.Client, reviewer: httpx.Client, demo: Path
) -> None:
    rows = rows_of(server)
    for client in (operator, reviewer):
        assert "role admin" in sentence(upload(client, packed(demo), "mine.zip"), 403)
    sentence(upload(server.stranger(), packed(demo), "mine.zip"), 401)
    assert rows_of(server) == rows


def test_an_upload_without_a_file_names_the_field(chief: httpx.Client) -> None:
    assert "body.file" in sentence(chief.post("/api/datasets"), 422)
    assert "body.file" in sentence(chief.post("/api/datasets", data={"file": "text"}), 422)


def test_two_uploads_at_once_make_one_dataset(server: LiveServer, chief: httpx.Client, demo: Path) -> None:
    answers: list[httpx.Response] = []
    content = packed(demo)
    clients = [server.stranger() for _ in range(2)]
    for client in clients:
        client.headers.update(chief.headers)
    threads = [
        threading.Thread(target=lambda c=client: answers.append(upload(c, content, "twice.zip")))
        for client in clients
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(LONGEST)
    assert [answer.status_code for answer in answers] == [201, 201]
    assert answers[0].json() == answers[1].json()


def test_what_looked_odd_is_told_until_it_is_accepted(own_live: LiveServer, shared_cases: Path) -> None:
    chief = own_live.script("chief", Role.ADMIN)
    taken = upload(chief, packed(shared_cases / "55-pose-in-opengl-axes"), "odd.zip").json()
    (warning,) = taken["warnings"]
    assert "behind the camera" in warning["text"] and warning["images"] == ["test/000001, image 0"]
    assert not warning["accepted"]
    operator = own_live.script("an operator", Role.OPERATOR)
    assert sentence(operator.post(f"/api/datasets/{taken['id']}/warnings/accept"), 403)
    accepted = chief.post(f"/api/datasets/{taken['id']}/warnings/accept").json()
    assert accepted["warnings"] == [{**warning, "accepted": True}]
    assert chief.get(f"/api/datasets/{taken['id']}").json()["warnings"] == accepted["warnings"]


def test_depth_in_another_unit_is_refused_with_what_would_do(
    own_live: LiveServer, shared_cases: Path
) -> None:
    chief = own_live.script("chief", Role.ADMIN)
    content = packed(shared_cases / "23-depth-scale-1000")
    before = rows_of(own_live)
    refused = upload(chief, content, "units.zip")
    assert "depth_scale 1000" in sentence(refused, 422)
    assert rows_of(own_live) == before
    suggested = refused.json()["suggested"]
    assert suggested == {"depth_scale": 1.0}
    file = {"file": ("units.zip", content, "application/zip")}
    for wrong in ("0", "-1", "nan", "inf", "much"):
        assert "depth" in sentence(chief.post("/api/datasets", files=file, data={"depth_scale": wrong}), 422)
    taken = chief.post("/api/datasets", files=file, data=suggested)
    assert taken.status_code == 201 and taken.json()["tasks"] == 1
