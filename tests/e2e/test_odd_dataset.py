"""A dataset in a wrong unit with a pose that cannot be: taken, looked at, and exported without it."""

import io
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.app.small_dataset import TOOL, change_json, true_pose, write_small_dataset
from tests.e2e.conftest import take_picture
from tests.processes import Server

pytestmark = pytest.mark.e2e

NAME = "odd units"


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    """Depth in units of a metre, a tool that hovers in one image, two folders deep in a zip."""
    root = write_small_dataset(tmp_path / NAME)
    for path in root.rglob("scene_camera.json"):
        change_json(path, lambda cameras: [entry.update(depth_scale=100.0) for entry in cameras.values()])
    change_json(root / "test/000001/scene_gt.json", lift)
    target = tmp_path / "upload.zip"
    with zipfile.ZipFile(target, "w") as packed:
        for path in root.rglob("*"):
            packed.write(path, f"inner/{NAME}/{path.relative_to(root)}")
    return target


def lift(truths: dict) -> None:
    truths["5"][0]["cam_t_m2c"][2] -= 200


def test_from_a_wrong_unit_to_an_export_of_what_is_right(
    server: Server, open_page: Callable[[str], Page], archive: Path
) -> None:
    page = open_page(server.new_link("lead of odd things", "admin"))
    page.get_by_role("button", name="Import", exact=True).click()
    dialog = page.get_by_role("dialog", name="Import a dataset")
    dialog.locator("#import-file").set_input_files(archive)
    dialog.get_by_role("button", name="Import", exact=True).click()
    expect(dialog.get_by_role("alert")).to_contain_text("or import with depth scale 0.1")
    take_picture(page, "import-wrong-unit")
    dialog.get_by_role("button", name="Import with depth scale 0.1").click()
    expect(page.locator("#message")).to_contain_text(f"Imported {NAME}")
    odd = page.get_by_role("button", name=f"What looked odd in {NAME}")
    expect(odd).to_contain_text("odd thing")
    odd.click()
    found = page.get_by_role("dialog", name=f"looked odd in {NAME}")
    expect(found).to_contain_text(f"Object {TOOL} hovers")
    expect(found).to_contain_text("test/000001, image 5")
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        take_picture(page, f"home-odd-{scheme}")
    found.get_by_role("button", name="It is right so").click()
    expect(odd).to_be_hidden()

    submit_all(page, server)
    page.goto(f"{server.url}/export")
    page.get_by_label("Dataset").select_option(NAME)
    page.get_by_role("button", name="Start the export").click()
    failures = page.locator("#failures li")
    expect(failures).to_have_count(2, timeout=90_000)  # the one that hovers is taken for a second tool
    expect(failures.first).to_contain_text("angle tool")
    expect(failures.first).to_contain_text("by lead of odd things")
    expect(failures.first).to_contain_text("off the measured depth")
    picture = failures.first.get_by_role("img", name="angle tool #1 as it was put")
    expect(picture).to_have_js_property("complete", True)
    assert picture.evaluate("image => image.naturalWidth") > 50
    failures.last.scroll_into_view_if_needed()
    take_picture(page, "export-failures")
    page.get_by_role("button", name="Export the rest without them").click()
    link = page.locator("#download")
    expect(link).to_be_visible(timeout=90_000)
    exported = zipfile.ZipFile(
        io.BytesIO(page.request.get(f"{server.url}{link.get_attribute('href')}").body())
    )
    assert any(name.endswith("test/000002/scene_gt.json") for name in exported.namelist())


def submit_all(page: Page, server: Server) -> None:
    """Every task of the dataset at its true pose; the tools of scene 1 a hand's breadth too high."""
    datasets = page.request.get(f"{server.url}/api/datasets").json()["items"]
    (dataset_id,) = (found["id"] for found in datasets if found["name"] == NAME)
    headers = {"origin": server.url}
    for task in page.request.get(f"{server.url}/api/tasks?dataset_id={dataset_id}").json()["items"]:
        posed = task["scene"]["label"] == "scene 1"
        T = true_pose(task["object"]["obj_id"], posed=posed)
        if posed and task["object"]["obj_id"] == TOOL:
            T[2, 3] += 0.1
        begun = page.request.post(f"{server.url}/api/tasks/{task['id']}/registration", headers=headers).json()
        url = f"{server.url}/api/registrations/{begun['id']}"
        put = page.request.put(f"{url}/pose", data={"T_world_object": T.tolist()}, headers=headers)
        assert put.status == 200, put.text()
        assert page.request.post(f"{url}/submit", headers=headers).status == 200
