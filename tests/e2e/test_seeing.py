"""Seeing whether a pose is right: depth agreement as colours and numbers, what can be put away, and how often
the outline is redrawn in a drag.
"""

import time
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from app.views3d.cloud_view import COARSE_POINTS
from registration_core.geometry import pose
from tests.app.waiting import LONGEST, wait_until
from tests.e2e.conftest import DRAWN_FINELY, take_picture
from tests.e2e.demo_truth import true_pose
from tests.e2e.gizmo import view_frame, wait_for_picture
from tests.e2e.image_panel import ImagePanel
from tests.e2e.labelling_page import LabellingPage
from tests.processes import Server

pytestmark = pytest.mark.e2e

COUNT_REDRAWS = """if (window === top) {
  window.redraws = 0;
  const original = WebGL2RenderingContext.prototype.drawArrays;
  WebGL2RenderingContext.prototype.drawArrays = function (...rest) {
    window.redraws += this.canvas.id === "outline";
    return original.apply(this, rest);
  };
}"""
DRAG_SECONDS = 4.0
IS_DRAWN = "name => window.__viserMutable.nodeRefFromName[name]?.visible"
POINTS_DRAWN = """([least, most]) => {
  let count = 0;
  const cloud = window.__viserMutable?.nodeRefFromName["/cloud"];
  cloud?.traverse(node => node.isPoints && (count = node.geometry.attributes.position.count));
  return least <= count && count <= most;
}"""
SHARPNESS = "window.__viserMutable.canvas.width / window.__viserMutable.canvas.clientWidth"
IS_HIDDEN = "name => window.__viserMutable.nodeRefFromName[name]?.visible === false"
NEARER = pose.exp([0.0, 0.0, -0.15, 0.0, 0.0, 0.0])
FARTHER = pose.exp([0.0, 0.0, 0.3, 0.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def image(server: Server, browser: Browser) -> Iterator[ImagePanel]:
    """The page of an operator before the mug of the first demo scene."""
    context = browser.new_context(viewport={"width": 1366, "height": 768}, reduced_motion="reduce")
    context.add_init_script(COUNT_REDRAWS)
    context.add_init_script(DRAWN_FINELY)
    problems: list[str] = []
    page = context.new_page()
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.goto(server.new_link("operator who looks"))
    yield ImagePanel(LabellingPage(page, server, "mug"))
    context.close()
    assert problems == []


def test_the_outline_is_redrawn_all_through_a_drag(image: ImagePanel) -> None:
    labelling, page = image.labelling, image.page
    start, end = labelling.take_hold("tz", 0.08)
    wait_until(lambda: labelling.state["dragging"], "the drag")
    before, began = page.evaluate("redraws"), time.monotonic()
    moves = redraws = 0
    passed = 0.0
    while passed < DRAG_SECONDS or (redraws < 5 and passed < LONGEST):  # however busy the machine is
        page.mouse.move(*(start + (end - start) * abs(np.sin(passed))))
        moves, passed = moves + 1, time.monotonic() - began
        redraws = page.evaluate("redraws") - before
    assert labelling.state["dragging"]
    page.mouse.up()
    print(f"{moves / passed:.1f} moves and {redraws / passed:.1f} redraws of the outline a second")
    assert redraws >= 5


def dominant(image: ImagePanel) -> str:
    """The verdict whose colour most of the object has on the image."""
    colors = {"match": (38, 173, 140), "in_front": (255, 233, 72), "behind": (151, 84, 255)}
    pixels = image.pixels
    inside = pixels[pixels[..., 3] == 217][:, :3].astype(
        float
    )  # 85 % opaque: no outline, no rim, no lack of data
    if len(inside) < 50:
        return ""
    shade = np.linalg.norm(np.median(inside, axis=0))
    unit = {name: np.array(rgb) / np.linalg.norm(rgb) for name, rgb in colors.items()}
    seen = np.median(inside, axis=0) / max(shade, 1.0)
    return max(unit, key=lambda name: float(unit[name] @ seen))


def is_dominant(image: ImagePanel, verdict: str) -> bool:
    return dominant(image) == verdict


def test_depth_agreement_is_seen_in_colours_and_numbers(image: ImagePanel) -> None:
    labelling, page = image.labelling, image.page
    T_world_camera = np.array(image.frames[0]["T_world_camera"])
    truth = pose.inverse(T_world_camera) @ true_pose(labelling.task["object"]["obj_id"])
    image.put(truth)
    share = page.locator("#agreement-share")
    expect(share).to_have_text(f"{100 * labelling.state['agreement']['inlier_share']:.0f} %")
    assert labelling.state["agreement"]["inlier_share"] > 0.9
    assert labelling.state["agreement"]["median_residual"] < 0.002
    expect(page.locator("#verdicts")).to_be_hidden()
    page.keyboard.press("r")
    expect(page.locator("#verdicts")).to_be_visible()
    page.keyboard.press("z")
    for T, verdict in ((truth, "match"), (NEARER @ truth, "in_front"), (FARTHER @ truth, "behind")):
        image.put(T)
        wait_until(partial(is_dominant, image, verdict), f"the colour of {verdict}", 40)
        shown = labelling.state["agreement"][verdict]
        row = page.locator(f"[data-verdict={verdict}] output")
        expect(row).to_have_text(f"{100 * shown:.0f} %")
        assert shown > 0.7
        labelling.frame.wait_for_function(IS_DRAWN, arg="/object/mesh/surface")
        wait_for_picture(labelling.frame)
        page.emulate_media(color_scheme="dark" if verdict == "behind" else "light")
        take_picture(page, f"label-agreement-{verdict}")
    page.get_by_role("button", name="Agreement").click()
    expect(page.locator("#verdicts")).to_be_hidden()
    wait_until(lambda: dominant(image) == "", "the outline alone")


def test_software_draws_few_points_unless_all_are_asked_for(
    server: Server, open_page: Callable[[str], Page]
) -> None:
    labelling = LabellingPage(open_page(server.new_link("without a graphics card")), server, "mug")
    page = labelling.page
    fine = page.get_by_role("button", name="Fine")
    expect(fine).to_have_attribute("aria-pressed", "false")
    labelling.frame.wait_for_function(POINTS_DRAWN, arg=[1, COARSE_POINTS])
    assert labelling.frame.evaluate(SHARPNESS) == pytest.approx(0.5, abs=0.01)
    wait_for_picture(labelling.frame)
    take_picture(page, "label-coarse")
    page.keyboard.press("Shift+F")
    labelling.frame.wait_for_function(POINTS_DRAWN, arg=[COARSE_POINTS + 1, 300_000])
    page.reload()
    frame = view_frame(page)
    assert frame.evaluate(SHARPNESS) == pytest.approx(1.0, abs=0.01)
    frame.wait_for_function(POINTS_DRAWN, arg=[COARSE_POINTS + 1, 300_000])
    expect(fine).to_have_attribute("aria-pressed", "true")
    fine.click()
    frame.wait_for_function(POINTS_DRAWN, arg=[1, COARSE_POINTS])


HIDDEN = {"cloud": False, "mesh": False, "texture": True, "fine": True, "agreement": False}


def test_the_object_is_shown_in_its_own_colours_or_in_the_operators(image: ImagePanel) -> None:
    labelling, page = image.labelling, image.page
    texture = page.get_by_role("button", name="Texture")
    expect(texture).to_have_attribute("aria-pressed", "true")
    labelling.frame.wait_for_function(IS_DRAWN, arg="/object/textured")
    labelling.frame.wait_for_function(IS_HIDDEN, arg="/object/mesh")
    wait_for_picture(labelling.frame)
    take_picture(page, "label-texture")
    page.keyboard.press("Shift+M")
    expect(texture).to_have_attribute("aria-pressed", "false")
    labelling.frame.wait_for_function(IS_DRAWN, arg="/object/mesh")
    labelling.frame.wait_for_function(IS_HIDDEN, arg="/object/textured")
    page.reload()
    frame = labelling.frame = view_frame(page)
    expect(texture).to_have_attribute("aria-pressed", "false")  # as the browser remembers
    frame.wait_for_function(IS_HIDDEN, arg="/object/textured")
    texture.click()
    frame.wait_for_function(IS_DRAWN, arg="/object/textured")
    page.keyboard.press("r")  # how depth agrees lies on the plain mesh
    frame.wait_for_function(IS_DRAWN, arg="/object/mesh/surface")
    frame.wait_for_function(IS_HIDDEN, arg="/object/textured")
    page.keyboard.press("r")
    frame.wait_for_function(IS_DRAWN, arg="/object/textured")


def test_cloud_and_mesh_are_put_away_and_stay_so(image: ImagePanel) -> None:
    labelling, page = image.labelling, image.page
    assert page.request.post(f"{labelling.url}/reset").ok
    page.keyboard.press("b")
    labelling.frame.wait_for_function(IS_HIDDEN, arg="/cloud")
    page.get_by_role("button", name="Mesh").click()
    labelling.frame.wait_for_function(IS_HIDDEN, arg="/object/textured")
    expect(page.get_by_role("button", name="Cloud")).to_have_attribute("aria-pressed", "false")
    assert labelling.drag("tz", 0.05)["dof"] == ["tz"]  # the gizmo stays
    take_picture(page, "label-layers-hidden")
    assert page.request.put(f"{labelling.url}/layers", data={}).ok  # as after the server was restarted
    wait_until(lambda: labelling.state["layers"] == HIDDEN, "what was chosen")
    page.keyboard.press("m")
    page.keyboard.press("b")  # at once: neither is lost
    wait_until(lambda: labelling.state["layers"] == {**HIDDEN, "cloud": True, "mesh": True}, "both")
