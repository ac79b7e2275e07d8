"""The first registration of the README, on a demo scene; its picture is taken here."""

import json
from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from registration_core.geometry import pose
from tests.conftest import REPOSITORY
from tests.e2e.conftest import drawing_finely, take_picture
from tests.e2e.gizmo import view_frame
from tests.e2e.test_labelling import Desk
from tests.processes import Server

pytestmark = pytest.mark.e2e

SCENES = REPOSITORY / "scenes/demo/test"


def true_pose(obj_id: int, scene_id: int = 1) -> np.ndarray:
    """T_world_object of an object in a demo scene, metres."""
    scene = SCENES / f"{scene_id:06d}"
    camera = json.loads((scene / "scene_camera.json").read_text())["0"]
    entries = json.loads((scene / "scene_gt.json").read_text())["0"]
    entry = next(entry for entry in entries if entry["obj_id"] == obj_id)
    T_camera_object = pose.from_rotation_translation(
        np.reshape(entry["cam_R_m2c"], (3, 3)), np.array(entry["cam_t_m2c"]) / 1000
    )
    T_camera_world = pose.from_rotation_translation(
        np.reshape(camera["cam_R_w2c"], (3, 3)), np.array(camera["cam_t_w2c"]) / 1000
    )
    return pose.inverse(T_camera_world) @ T_camera_object


def test_first_registration(server: Server, open_page: Callable[[str], Page]) -> None:
    page = open_page(server.new_link("lea", "admin"))
    page.wait_for_url(f"{server.url}/")
    expect(page.locator("[data-task-id]").first).to_be_visible()
    page.wait_for_load_state("networkidle")
    take_picture(page, "home")
    desk = Desk(drawing_finely(page), server, "mug")
    assert desk.task["scene"]["label"] == "scene 1"
    take_picture(page, "label-first-sight")

    truth = true_pose(desk.task["object"]["obj_id"])
    roughly = pose.perturbed(truth, 0.02, np.radians(15), np.random.default_rng(1))
    assert page.request.put(f"{desk.url}/pose", data={"T_world_object": roughly.tolist()}).ok
    view_frame(page)
    take_picture(page, "label-roughly-placed")
    page.keyboard.press("Space")
    desk.events("snap_applied")
    expect(page.locator("#source")).to_contain_text("machine")
    view_frame(page)
    take_picture(page, "labelling")
    assert pose.distance(desk.pose, truth).translation < 0.005

    page.keyboard.press("Enter")
    desk.events("submit")
    expect(page.locator("#submitted")).to_be_visible()
    take_picture(page, "label-submitted")
    page.keyboard.press("Enter")
    page.wait_for_url(lambda url: url.startswith(f"{server.url}/label/") and url != desk.page_url)
    view_frame(page)
