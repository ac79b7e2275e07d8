"""Objects: their sizes and symmetries in metres, their meshes as they were imported."""

from pathlib import Path

import httpx
import numpy as np
import pytest

from app.datasets.importing import import_dataset
from registration_core import ObjectModel
from registration_core.geometry.mesh_file import plain_ply, read_mesh
from tests.app.live import LiveServer
from tests.app.rest import sentence
from tests.app.small_dataset import BLOCK, TOOL, change_json


@pytest.fixture
def objects(operator: httpx.Client) -> list[dict]:
    return operator.get("/api/objects?dataset_id=1").json()["items"]


def test_objects_tell_their_names_and_sizes(objects: list[dict], operator: httpx.Client, demo: Path) -> None:
    assert [(item["obj_id"], item["name"]) for item in objects] == [(TOOL, "angle tool"), (BLOCK, "block")]
    for item in objects:
        model = ObjectModel.load(demo / f"models/obj_{item['obj_id']:06d}.ply", unit="mm")
        assert item["diameter"] == pytest.approx(model.diameter, rel=1e-3)
        assert item["symmetries"] == {"discrete": [], "continuous": []}
        detail = operator.get(f"/api/objects/{item['id']}").json()
        assert detail | item == detail
        assert detail["size"] == pytest.approx(np.ptp(model.vertices, axis=0))


def test_a_mesh_is_the_bytes_that_were_imported(
    objects: list[dict], operator: httpx.Client, demo: Path
) -> None:
    for item in objects:
        answer = operator.get(item["mesh_url"])
        assert answer.status_code == 200
        assert answer.content == (demo / f"models/obj_{item['obj_id']:06d}.ply").read_bytes()


def test_the_mesh_for_outlines_is_in_metres_and_kept_by_the_browser(
    objects: list[dict], operator: httpx.Client, demo: Path
) -> None:
    for item in objects:
        answer = operator.get(item["outline_mesh_url"])
        assert answer.headers["content-type"] == "application/octet-stream"
        assert "immutable" in answer.headers["cache-control"]
        vertex_count, face_count = np.frombuffer(answer.content, "<u4", 2)
        vertices = np.frombuffer(answer.content, "<f4", 3 * vertex_count, 8).reshape(-1, 3)
        model = ObjectModel.load(demo / f"models/obj_{item['obj_id']:06d}.ply", unit="mm")
        assert np.allclose(vertices.min(axis=0), model.vertices.min(axis=0))
        assert np.allclose(vertices.max(axis=0), model.vertices.max(axis=0))
        assert face_count == len(model.faces)
    assert len({item["outline_mesh_url"].partition("content=")[2] for item in objects}) == len(objects)


def test_the_mesh_in_its_own_colours_is_there_where_it_has_any(
    server: LiveServer, operator: httpx.Client, objects: list[dict], demo_copy: Path
) -> None:
    plain = f"/api/objects/{objects[0]['id']}"
    assert operator.get(plain).json()["textured_mesh_url"] is None
    assert "no colours" in sentence(operator.get(f"{plain}/textured.mesh"), 404)

    path = demo_copy / f"models/obj_{TOOL:06d}.ply"
    mesh = read_mesh(path.read_bytes(), "ply")
    mesh.visual.vertex_colors = [10, 20, 30, 255]
    path.write_bytes(plain_ply(mesh))
    import_dataset(server.services.database, server.services.files, demo_copy, "coloured")
    url = textured_url(operator, "coloured")
    answer = operator.get(url)
    assert "immutable" in answer.headers["cache-control"]
    vertex_count, face_count, picture_size = np.frombuffer(answer.content, "<u4", 3)
    assert (vertex_count, face_count, picture_size) == (len(mesh.vertices), len(mesh.faces), 0)
    vertices = np.frombuffer(answer.content, "<f4", 3 * vertex_count, 12).reshape(-1, 3)
    assert np.allclose(vertices, mesh.vertices / 1000.0, atol=1e-6)
    colors = answer.content[12 + 12 * vertex_count + 12 * face_count :]
    assert colors == bytes([10, 20, 30, 255]) * vertex_count


def textured_url(operator: httpx.Client, dataset: str) -> str:
    """Of the first object of a dataset."""
    datasets = operator.get("/api/datasets").json()["items"]
    (dataset_id,) = [one["id"] for one in datasets if one["name"] == dataset]
    items = operator.get(f"/api/objects?dataset_id={dataset_id}").json()["items"]
    return operator.get(f"/api/objects/{items[0]['id']}").json()["textured_mesh_url"]


def test_symmetries_are_in_metres(server: LiveServer, operator: httpx.Client, demo_copy: Path) -> None:
    half_turn = np.diag([-1.0, -1.0, 1.0, 1.0])
    half_turn[0, 3] = 12.0  # millimetres in BOP
    entry = {
        "symmetries_discrete": [half_turn.ravel().tolist()],
        "symmetries_continuous": [{"axis": [0, 0, 1], "offset": [0, 5, 0]}],
    }
    change_json(demo_copy / "models/models_info.json", lambda infos: infos[str(BLOCK)].update(entry))
    summary = import_dataset(server.services.database, server.services.files, demo_copy, "symmetric")
    items = operator.get(f"/api/objects?dataset_id={summary.dataset_id}").json()["items"]
    (block,) = [item for item in items if item["obj_id"] == BLOCK]
    (discrete,) = block["symmetries"]["discrete"]
    half_turn[0, 3] = 0.012
    assert np.allclose(discrete, half_turn)
    (continuous,) = block["symmetries"]["continuous"]
    assert np.allclose(continuous["axis"], [0, 0, 1]) and np.allclose(continuous["offset"], [0, 0.005, 0])


def test_lists_come_in_pages(operator: httpx.Client, objects: list[dict]) -> None:
    first = operator.get("/api/objects?dataset_id=1&limit=1").json()
    second = operator.get(f"/api/objects?dataset_id=1&limit=1&after={first['next']}").json()
    assert first["items"] + second["items"] == objects
    assert second["next"] is None


@pytest.mark.parametrize("url", ["objects/999", "objects/999/mesh.ply", "objects/999/outline.mesh"])
def test_what_does_not_exist_is_said(operator: httpx.Client, url: str) -> None:
    assert "no object 999" in sentence(operator.get(f"/api/{url}"), 404)
