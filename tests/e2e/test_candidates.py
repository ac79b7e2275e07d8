"""Finding the object, choosing between poses, and what is unsure about one, with real mouse and keys."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from registration_core.geometry import pose
from tests.e2e.conftest import drawing_finely, take_picture
from tests.e2e.demo_truth import true_pose
from tests.e2e.gizmo import wait_for_picture
from tests.e2e.labelling_page import GHOST_HIDDEN, GHOST_SHOWN, LabellingPage
from tests.processes import Server

pytestmark = pytest.mark.e2e

HIDDEN_HANDLE = (3, 2)
"""Scene, and frame from the first on, where the mug's handle is behind it: depth cannot tell its turn."""


def test_find_shows_candidates_and_one_is_taken(server: Server, open_page: Callable[[str], Page]) -> None:
    labelling = LabellingPage(drawing_finely(open_page(server.new_link("finder"))), server, "box")
    page = labelling.page
    start = labelling.pose
    page.keyboard.press("f")
    (found,) = labelling.events("search_done")
    cards = page.locator("#candidate-list button")
    expect(cards).to_have_count(min(5, len(found["detail"]["candidates"])), timeout=30_000)
    expect(cards.first).to_have_attribute("aria-pressed", "true")
    labelling.frame.wait_for_function(GHOST_SHOWN)
    assert np.allclose(labelling.pose, start)
    wait_for_picture(labelling.frame)
    take_picture(page, "label-find")
    page.emulate_media(color_scheme="dark")
    take_picture(page, "label-find-dark")
    page.emulate_media(color_scheme="light")

    page.keyboard.press("]")
    expect(cards.nth(1)).to_have_attribute("aria-pressed", "true")
    wait_for_preview(labelling, found["detail"]["candidates"][1])
    page.keyboard.press("[")
    expect(cards.first).to_have_attribute("aria-pressed", "true")
    wait_for_preview(labelling, found["detail"]["candidates"][0])
    page.reload()
    expect(cards.first).to_have_attribute("aria-pressed", "true", timeout=30_000)
    page.keyboard.press("y")
    (taken,) = labelling.events("set_pose")
    assert taken["detail"] == {"technique": "proposal", "stems_from": found["snap_id"]}
    expect(page.locator("#candidates")).to_be_hidden()
    expect(page.locator("#source")).to_have_text("posed by the machine")
    expect(page.locator("#outline")).to_have_attribute("data-source", "machine")
    truth = true_pose(labelling.task["object"]["obj_id"])
    assert pose.distance(labelling.pose, truth).translation < 0.01
    page.keyboard.press("Control+z")
    labelling.events("undo")
    assert np.allclose(labelling.pose, start)

    page.locator("#find").click(timeout=90_000)
    labelling.events("search_done", 2)
    expect(page.locator("#candidates")).to_be_visible(timeout=30_000)
    page.keyboard.press("Escape")
    expect(page.locator("#candidates")).to_be_hidden()
    labelling.wait_for(lambda state: state["search"] is None and state["preview"] is None)


def test_modes_and_what_depth_cannot_tell_are_shown(server: Server, open_page: Callable[[str], Page]) -> None:
    labelling = LabellingPage(open_page(server.new_link("doubter")), server, "mug", scene_id=HIDDEN_HANDLE[0])
    page = labelling.page
    frames = page.request.get(f"{labelling.root}/api/scenes/{HIDDEN_HANDLE[0]}").json()["frames"]
    frame_id = frames[HIDDEN_HANDLE[1]]["id"]
    assert page.request.put(f"{labelling.url}/frame", data={"frame_id": frame_id}).ok
    truth = true_pose(labelling.task["object"]["obj_id"], HIDDEN_HANDLE[0])
    near = pose.perturbed(truth, 0.01, np.radians(8), np.random.default_rng(1))
    assert page.request.put(f"{labelling.url}/pose", data={"T_world_object": near.tolist()}).ok
    assert page.request.put(
        f"{labelling.url}/snap-frames", data={"frames": "current"}
    ).ok  # others see the handle
    assert page.request.post(f"{labelling.url}/snaps", data={"seed": 1}).ok
    (applied,) = labelling.events("snap_applied")
    cards = page.locator("#candidate-list button")
    expect(page.locator("#candidates-title")).to_contain_text("The depth fits", timeout=30_000)
    expect(page.locator("#uncertainty-size")).to_contain_text("mm, ±", timeout=30_000)
    expect(page.locator("#unknown-motions")).to_contain_text(re.compile(r"[Aa]rc( 1)?: .* about the z axis"))
    labelling.frame.wait_for_function(shown("/uncertainty/motions"))
    wait_for_picture(labelling.frame)
    take_picture(page, "label-uncertainty")

    page.keyboard.press("]")
    expect(cards.nth(1)).to_have_attribute("aria-pressed", "true")
    labelling.frame.wait_for_function(GHOST_SHOWN)
    page.keyboard.press("Shift+v")
    expect(page.locator("#hide-uncertainty")).to_contain_text("Show")
    labelling.frame.wait_for_function(f"() => !({shown('/uncertainty')})()")
    page.emulate_media(color_scheme="dark")
    take_picture(page, "label-modes-dark")
    page.keyboard.press("Escape")
    expect(page.locator("#candidates")).to_be_hidden()
    labelling.frame.wait_for_function(GHOST_HIDDEN)
    page.keyboard.press("]")
    expect(cards.nth(1)).to_have_attribute("aria-pressed", "true")
    page.locator("#candidates-leave").click()
    expect(page.locator("#candidates")).to_be_hidden()

    page.reload()
    expect(page.locator("#candidates-title")).to_contain_text("The depth fits", timeout=60_000)
    expect(page.locator("#hide-uncertainty")).to_contain_text("Show")
    cards.nth(1).dblclick(timeout=90_000)
    (_, taken) = labelling.events("set_pose", 2)
    assert taken["detail"] == {"technique": "mode", "stems_from": applied["snap_id"]}
    expect(page.locator("#candidates")).to_be_hidden()
    expect(page.locator("#uncertainty")).to_be_hidden()
    page.keyboard.press("Control+z")
    labelling.events("undo")
    assert np.allclose(labelling.pose, applied["T_after"])
    expect(page.locator("#candidates")).to_be_visible(timeout=30_000)


def shown(node: str) -> str:
    """Tells in the 3-D view whether a node is there and visible."""
    return f"() => window.__viserMutable.nodeRefFromName[{node!r}]?.visible === true"


def wait_for_preview(labelling: LabellingPage, candidate: dict) -> None:
    """Return when the server knows that this one is looked at."""
    frame_id, scene_id = labelling.state["frame_id"], labelling.task["scene"]["id"]
    frames = labelling.page.request.get(f"{labelling.root}/api/scenes/{scene_id}").json()["frames"]
    T_world_camera = next(np.array(one["T_world_camera"]) for one in frames if one["id"] == frame_id)
    wanted = T_world_camera @ np.array(candidate["T_camera_object"])
    labelling.wait_for(lambda state: state["preview"] is not None and np.allclose(state["preview"], wanted))
