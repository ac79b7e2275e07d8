"""From a task to an exported dataset, with the mouse, on real data."""

import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from registration_core import ObjectModel
from registration_core.geometry import pose
from registration_core.geometry.pose_error import adi
from tests.e2e.conftest import take_picture
from tests.e2e.gizmo import Handle, pull, take_hold, view_frame, wait_for_object
from tests.processes import Server

pytestmark = pytest.mark.e2e

MUG = 14
DRAGGED = 0.02
"""Metres."""


def official_pose(ycbv: Path) -> np.ndarray:
    """T_camera_object of the mug in frame 0, metres."""
    truth = json.loads((ycbv / "test/000001/scene_gt.json").read_text())["0"]
    mug = next(entry for entry in truth if entry["obj_id"] == MUG)
    rotation = np.reshape(mug["cam_R_m2c"], (3, 3))
    return pose.from_rotation_translation(rotation, np.array(mug["cam_t_m2c"]) / 1000)


def test_mug_of_frame_0(server: Server, ycbv: Path, open_page: Callable[[str], Page], tmp_path: Path) -> None:
    official = official_pose(ycbv)
    page = open_page(server.new_link("mia", "admin"))
    page.wait_for_url(f"{server.url}/")
    page.get_by_text("ycbv").first.click()
    card = page.locator("[data-task-id]", has_text="frame 0").filter(has_text="025_mug")
    card.wait_for()
    page.wait_for_load_state("networkidle")
    take_picture(page, "home-ycbv")
    card.click()
    page.wait_for_url("**/label/*")
    frame = view_frame(page)

    # The start is such that the drag along the gizmo's x axis ends 2 cm and 15 degrees off.
    target = pose.perturbed(official, 0.02, np.radians(15), np.random.default_rng(5))
    start = target @ pose.exp([-DRAGGED, 0, 0, 0, 0, 0])
    task_id = urlsplit(page.url).path.rsplit("/", 1)[1]
    registration = page.request.post(f"{server.url}/api/tasks/{task_id}/registration").json()
    url = f"{server.url}/api/registrations/{registration['id']}"
    assert page.request.put(f"{url}/pose", data={"T_world_object": start.tolist()}).ok
    expect(page.locator("#undo")).to_be_enabled()
    model = ObjectModel.load(ycbv / "models/obj_000014.ply", unit="mm")
    wait_for_object(frame, pose.apply(start, model.centre))
    take_picture(page, "label-mug-start")

    pull(page, *take_hold(page, frame, Handle("tx", 0.75 * model.diameter), DRAGGED))
    page.mouse.up()
    events = wait_for_events(page, url, "drag")
    (drawn,) = [event for event in events if event["kind"] == "drag"]
    assert drawn["dof"] == ["tx"]
    assert drawn["actor"] == "human"
    assert len(drawn["path"]) >= 3
    moved = pose.distance(np.array(drawn["T_before"]), np.array(drawn["T_after"]))
    assert moved.translation == pytest.approx(DRAGGED, rel=0.15)
    take_picture(page, "label-mug-dragged")

    page.locator("#snap").click()
    wait_for_events(page, url, "snap_applied")
    expect(page.locator("#confidence")).not_to_have_attribute("aria-valuenow", "0")
    take_picture(page, "label-mug-snapped")
    page.locator("#submit").click()
    wait_for_events(page, url, "submit")
    take_picture(page, "label-mug-submitted")

    exported = export_with_page(page, server, tmp_path)
    truth = json.loads(exported.read("ycbv/test/000001/scene_gt.json"))["0"]
    (mug,) = [entry for entry in truth if entry["obj_id"] == MUG]
    rotation = np.reshape(mug["cam_R_m2c"], (3, 3))
    found = pose.from_rotation_translation(rotation, np.array(mug["cam_t_m2c"]) / 1000)
    assert adi(found, official, model.vertices) < 0.005
    log = [json.loads(line) for line in exported.read("ycbv/interaction_log/events.jsonl").splitlines()]
    assert ["tx"] in [event["dof"] for event in log if event["kind"] == "drag"]


def wait_for_events(page: Page, url: str, kind: str) -> list[dict]:
    """The log, once it has an event of this kind."""
    for _ in range(300):
        events = page.request.get(f"{url}/events?limit=500").json()["items"]
        if any(event["kind"] == kind for event in events):
            return events
        page.wait_for_timeout(100)
    raise AssertionError(f"no {kind} in {[event['kind'] for event in events]}")


def export_with_page(page: Page, server: Server, folder: Path) -> zipfile.ZipFile:
    """What the export page gives to download for ycbv."""
    page.goto(f"{server.url}/export")
    page.get_by_label("Dataset").select_option(label="ycbv")
    page.get_by_role("button", name="Start the export").click()
    link = page.locator("#download")  # of this export: earlier ones are listed below it
    link.wait_for(timeout=120_000)
    take_picture(page, "export-done")
    with page.expect_download() as download:
        link.click()
    path = folder / "export.zip"
    download.value.save_as(path)
    return zipfile.ZipFile(io.BytesIO(path.read_bytes()))
