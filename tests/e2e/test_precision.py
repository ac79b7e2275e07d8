"""Small and exact changes of the pose, views, and placing by a click, with keys and mouse on a demo scene."""

import re
import time
from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from registration_core.geometry import pose
from tests.e2e.conftest import take_picture
from tests.e2e.gizmo import pixel, wait_for_picture
from tests.e2e.precise_labelling_page import MODEL, PreciseLabellingPage, true_pose
from tests.processes import Server

pytestmark = pytest.mark.e2e

COVERED = """() => [...document.querySelectorAll(".stage button, .strip > button, .strip > span button")]
  .filter(node => node.checkVisibility())
  .filter(node => {
    const { left, top, width, height } = node.getBoundingClientRect();
    return !node.contains(document.elementFromPoint(left + width / 2, top + height / 2));
  })
  .map(node => node.id || node.textContent)"""
"""Controls over and below the view that something else lies on."""


@pytest.fixture
def labelling(
    server: Server, open_page: Callable[[str], Page], request: pytest.FixtureRequest
) -> PreciseLabellingPage:
    """A new operator before the bottle of the first scene."""
    name = re.sub(r"\W", "-", request.node.name)[:60]
    return PreciseLabellingPage(open_page(server.new_link(name)), server, "bottle")


def motion(event: dict) -> tuple[np.ndarray, np.ndarray]:
    """Change of the object's origin, and of its rotation, in the world."""
    before, after = np.array(event["T_before"]), np.array(event["T_after"])
    return after[:3, 3] - before[:3, 3], after[:3, :3] @ before[:3, :3].T


def test_keys_nudge_in_three_steps_and_three_frames(labelling: PreciseLabellingPage) -> None:
    page = labelling.page
    page.locator("#precision summary").click()
    T = labelling.pose
    right = labelling.T_world_camera[:3, 0]  # the first view is the sensor's
    for key, step in (("1", 0.0005), ("3", 0.01), ("2", 0.002)):
        page.keyboard.press(key)
        event = labelling.press("l")
        assert event["detail"] == {"technique": "nudge"}
        assert motion(event)[0] == pytest.approx(step * right, abs=1e-5)
    expect(page.locator("[data-step='1']")).to_have_attribute("aria-pressed", "true")
    page.keyboard.press("x")
    expect(page.locator("[data-axes='object']")).to_have_attribute("aria-pressed", "true")
    assert motion(labelling.press("i"))[0] == pytest.approx(0.002 * T[:3, 1], abs=1e-9)
    page.locator("[data-axes='world']").click()
    assert motion(labelling.press("u"))[0] == pytest.approx([0, 0, -0.002], abs=1e-9)
    turned = labelling.press("Shift+o")
    assert motion(turned)[1] == pytest.approx(pose.exp([0, 0, 0, 0, 0, np.radians(2)])[:3, :3])
    assert np.allclose(labelling.press("Shift+u")["T_after"], turned["T_before"])
    page.keyboard.press("Control+z")
    labelling.events("undo")
    assert np.allclose(labelling.pose, turned["T_after"])
    take_picture(page, "label-precision")
    page.emulate_media(color_scheme="dark")
    take_picture(page, "label-precision-dark")
    page.reload()
    expect(page.locator("#precision")).to_have_attribute("open", "")
    expect(page.locator("[data-axes='world']")).to_have_attribute("aria-pressed", "true")


def test_a_key_held_down_goes_on_and_overtakes_nothing(labelling: PreciseLabellingPage) -> None:
    page = labelling.page
    T = labelling.pose
    page.keyboard.press("x")
    for _ in range(12):  # as the keyboard repeats it
        page.keyboard.down("o")
    page.keyboard.up("o")
    wanted = T @ pose.exp([0, 0, 12 * 0.002, 0, 0, 0])
    deadline = time.monotonic() + 30
    while not np.allclose(labelling.pose, wanted, atol=1e-9):  # several presses may come as one event
        assert time.monotonic() < deadline, labelling.pose
        page.wait_for_timeout(50)


def test_quarter_turns_and_flips_keep_the_middle(labelling: PreciseLabellingPage) -> None:
    page = labelling.page
    T = labelling.pose
    page.keyboard.press("x")
    for _ in range(4):
        event = labelling.press("Alt+l")
        assert (event["detail"]["technique"], event["dof"]) == ("turn", ["rx"])
    assert labelling.pose == pytest.approx(T, abs=1e-9)
    for _ in range(2):
        assert labelling.press("Alt+Shift+O")["detail"]["technique"] == "flip"
    assert labelling.pose == pytest.approx(T, abs=1e-9)
    page.locator("#precision summary").click()
    by_button = labelling.change(
        lambda: page.get_by_role("button", name="Turn by 90 degrees about z").click()
    )
    assert by_button["dof"] == ["rz"]
    page.keyboard.press("Control+z")
    labelling.events("undo")
    flipped = labelling.change(lambda: page.get_by_role("button", name="Flip about y").click())
    assert (flipped["dof"], flipped["detail"]["technique"]) == (["ry"], "flip")


def test_numbers_can_be_typed(labelling: PreciseLabellingPage) -> None:
    page = labelling.page
    field = page.locator("[data-pose=x]")
    expect(field).not_to_have_value("")
    before = np.linalg.inv(labelling.T_world_camera) @ labelling.pose
    field.click()
    page.keyboard.type("77,5")
    page.keyboard.press("Escape")
    expect(field).to_have_value(f"{1000 * before[0, 3]:.1f}")
    assert labelling.moves() == 0
    field.click()
    page.keyboard.type("12.5")
    event = labelling.press("Enter")
    assert event["detail"] == {"technique": "numbers"}
    after = np.linalg.inv(labelling.T_world_camera) @ labelling.pose
    assert after[:3, 3] == pytest.approx([0.0125, before[1, 3], before[2, 3]], abs=1e-9)
    assert after[:3, :3] == pytest.approx(before[:3, :3])
    expect(field).to_have_value("12.5")

    vector = pose.log(after)[3:]
    page.locator("[data-pose=ry]").click()
    page.keyboard.type("-30")
    labelling.press("Enter")
    turned = pose.log(np.linalg.inv(labelling.T_world_camera) @ labelling.pose)
    assert turned[:3] == pytest.approx(after[:3, 3])
    expected = pose.exp([0, 0, 0, vector[0], np.radians(-30), vector[2]])
    assert pose.exp(turned)[:3, :3] == pytest.approx(expected[:3, :3])
    page.locator("[data-pose=z]").click()
    page.keyboard.type("near")
    page.keyboard.press("Enter")
    expect(page.locator("#message")).to_contain_text("no number")
    assert labelling.moves() == 2
    assert labelling.state["state"] == "open"  # Enter in a field submits nothing


def test_the_gizmo_in_the_worlds_axes_drags_along_them(labelling: PreciseLabellingPage) -> None:
    page = labelling.page
    T = labelling.press("Shift+i")["T_after"]  # so that no axis of the object is one of the world
    page.keyboard.press("g")
    expect(page.locator("[data-gizmo=world]")).to_have_attribute("aria-pressed", "true")
    labelling.frame.wait_for_function(
        "() => Math.abs(window.__viserMutable.nodeRefFromName['/object'].quaternion.w) > 0.9999"
    )
    wait_for_picture(labelling.frame)
    for handle, amount, expected in (("tz", 0.03, {"tz"}), ("rz", 0.3, {"rz"}), ("tx", 0.03, {"tx"})):
        event = labelling.drag(handle, amount)
        assert (set(event["dof"]), event["detail"]["axes"]) == (expected, "world")
        labelling.frame.wait_for_function(
            "() => Math.abs(window.__viserMutable.nodeRefFromName['/object'].quaternion.w) > 0.9999"
        )
    assert labelling.pose[:3, 2] == pytest.approx(np.array(T)[:3, 2], abs=0.35)
    take_picture(page, "label-gizmo-world")


def test_views_from_all_sides_and_none_while_dragging(labelling: PreciseLabellingPage) -> None:
    page = labelling.page
    page.keyboard.press("Shift+P")
    labelling.events("set_pose")
    T = labelling.pose
    seen = {}
    before = labelling.camera
    for key, name in (("6", "top"), ("7", "front"), ("8", "side"), ("9", "left"), ("4", "object")):
        page.keyboard.press(key)
        seen[name] = before = labelling.wait_for_camera(before)
        take_picture(page, f"label-view-{name}")
        middle = pixel(page, labelling.frame, np.zeros(3)) - pixel_of_middle(page)
        assert np.abs(middle).max() < 5, name
    assert np.degrees(pose.rotation_angle(seen["top"][:3, :3].T @ seen["front"][:3, :3])) == pytest.approx(
        89, abs=1
    )
    assert np.degrees(pose.rotation_angle(seen["side"][:3, :3].T @ seen["left"][:3, :3])) == pytest.approx(
        30, abs=0.5
    )
    page.locator("[data-look=sensor]").click()
    labelling.wait_for_camera(before)
    assert np.array_equal(labelling.pose, T)
    start, _ = labelling.take_hold("tx", 0.0)
    page.mouse.move(*(start + 4))
    page.mouse.move(*(start + 8))
    expect(page.locator("[data-look=top]")).to_be_disabled()
    still = labelling.camera
    page.keyboard.press("6")
    page.mouse.move(*(start + 12))
    page.mouse.up()
    labelling.events("drag")
    wait_for_picture(labelling.frame)
    assert np.array_equal(labelling.camera, still)


def near(T: np.ndarray) -> object:
    """The same place, but for the planes that are drawn at random."""
    return pytest.approx(np.array(T), abs=0.005)


def pixel_of_middle(page: Page) -> np.ndarray:
    box = page.locator("#view").bounding_box()
    assert box is not None
    return np.array([box["x"] + box["width"] / 2, box["y"] + box["height"] / 2])


def test_a_click_in_the_image_places_the_object(labelling: PreciseLabellingPage) -> None:
    page = labelling.page
    truth = pose.apply(true_pose(labelling), MODEL.centre)
    T = labelling.pose
    page.keyboard.press("p")
    expect(page.locator("#place-mode")).to_be_visible()
    take_picture(page, "label-place")
    page.keyboard.press("Escape")
    expect(page.locator("#place-mode")).to_be_hidden()
    page.locator("#place").click()
    at = labelling.image_place(truth)
    event = labelling.change(lambda: page.mouse.click(*at))
    assert event["detail"] == {"technique": "place"}
    placed = labelling.pose
    page.keyboard.press("Control+z")
    labelling.events("undo")
    assert np.array(labelling.change(lambda: page.mouse.dblclick(*at))["T_after"]) == near(placed)
    expect(page.locator("#place-mode")).to_be_hidden()
    assert labelling.pose[:3, :3] == pytest.approx(T[:3, :3])
    assert np.linalg.norm(pose.apply(labelling.pose, MODEL.centre) - truth) < 0.05
    take_picture(page, "label-placed")


def test_a_click_on_the_cloud_places_the_object_and_elsewhere_is_said(
    labelling: PreciseLabellingPage,
) -> None:
    page = labelling.page
    T = labelling.pose
    page.keyboard.press("p")
    stage = page.locator("#view").bounding_box()
    assert stage is not None
    page.mouse.click(stage["x"] + 3, stage["y"] + 3)
    expect(page.locator("#message")).to_contain_text("no point of the cloud")
    expect(page.locator("#place-mode")).to_be_visible()
    where = np.array([stage["x"] + 0.42 * stage["width"], stage["y"] + 0.55 * stage["height"]])
    event = labelling.change(lambda: page.mouse.click(*where))
    assert event["detail"] == {"technique": "place"}
    page.keyboard.press("Control+z")
    labelling.events("undo")
    assert np.array(labelling.change(lambda: page.mouse.dblclick(*where))["T_after"]) == near(
        event["T_after"]
    )
    assert labelling.pose[:3, :3] == pytest.approx(T[:3, :3])
    expect(page.locator("#place-mode")).to_be_hidden()
    labelling.wait_until_shown()
    wait_for_picture(labelling.frame)
    assert np.abs(pixel(page, labelling.frame, np.zeros(3)) - where).max() < 60
    page.keyboard.press("?")
    take_picture(page, "label-keys-precision")


def test_the_settings_cover_no_control(labelling: PreciseLabellingPage) -> None:
    labelling.page.locator("#precision summary").click()
    labelling.page.keyboard.press("f")  # with candidates, which lie over the view as well
    expect(labelling.page.locator("#candidates")).to_be_visible(timeout=60_000)
    take_picture(labelling.page, "label-precision-open")
    assert labelling.page.evaluate(COVERED) == []
