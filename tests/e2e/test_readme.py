"""The first registration of the README, on a demo scene; its picture is taken here."""

from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from registration_core.geometry import pose
from tests.e2e.conftest import drawing_finely, take_picture
from tests.e2e.demo_truth import true_pose
from tests.e2e.gizmo import view_frame
from tests.e2e.labelling_page import LabellingPage
from tests.processes import Server

pytestmark = pytest.mark.e2e


def test_first_registration(server: Server, open_page: Callable[[str], Page]) -> None:
    page = open_page(server.new_link("lea", "admin"))
    page.wait_for_url(f"{server.url}/")
    expect(page.locator("[data-task-id]").first).to_be_visible()
    page.wait_for_load_state("networkidle")
    take_picture(page, "home")
    labelling = LabellingPage(drawing_finely(page), server, "mug")
    assert labelling.task["scene"]["label"] == "scene 1"
    take_picture(page, "label-first-sight")

    truth = true_pose(labelling.task["object"]["obj_id"])
    roughly = pose.perturbed(truth, 0.02, np.radians(15), np.random.default_rng(1))
    assert page.request.put(f"{labelling.url}/pose", data={"T_world_object": roughly.tolist()}).ok
    view_frame(page)
    take_picture(page, "label-roughly-placed")
    page.keyboard.press("Space")
    labelling.events("snap_applied")
    expect(page.locator("#source")).to_contain_text("machine")
    view_frame(page)
    take_picture(page, "labelling")
    assert pose.distance(labelling.pose, truth).translation < 0.005

    page.keyboard.press("Enter")
    labelling.events("submit")
    expect(page.locator("#submitted")).to_be_visible()
    take_picture(page, "label-submitted")
    page.keyboard.press("Enter")
    page.wait_for_url(lambda url: url.startswith(f"{server.url}/label/") and url != labelling.page_url)
    view_frame(page)
