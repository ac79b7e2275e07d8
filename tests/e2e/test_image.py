"""The colour image of the labelling page: the outline on it, zoom, blend, and a browser without WebGL."""

from collections.abc import Iterator
from functools import partial

import numpy as np
import pytest
from playwright.sync_api import Browser, expect

from registration_core.geometry import pose
from registration_core.rendering.rasterizer import render_depth
from tests.app.waiting import wait_until
from tests.e2e.conftest import take_picture
from tests.e2e.gizmo import wait_for_picture
from tests.e2e.image_panel import COVERED, ImagePanel, View
from tests.e2e.labelling_page import LabellingPage
from tests.processes import Server

pytestmark = pytest.mark.e2e

NO_WEBGL = """if (window === top) {
  const original = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
    return kind === "webgl2" ? null : original.call(this, kind, ...rest);
  };
}"""
HELD_IN_VIEW = pose.exp([0.01, 0.02, 0.6, 0.5, -0.7, 0.9])
"""T_camera_object of an object before the camera, seen askew."""


@pytest.fixture(scope="module")
def mug(server: Server, browser: Browser) -> Iterator[ImagePanel]:
    """The page of an operator before the mug of the first demo scene."""
    context = browser.new_context(viewport={"width": 1366, "height": 768}, reduced_motion="reduce")
    problems: list[str] = []
    page = context.new_page()
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.goto(server.new_link("operator of images"))
    yield ImagePanel(LabellingPage(page, server, "mug"))
    context.close()
    assert problems == []


@pytest.fixture
def image(mug: ImagePanel) -> ImagePanel:
    """The same page with the object before the camera, all of the image, and the outline alone."""
    mug.put(HELD_IN_VIEW)
    mug.blend(0.0)
    if (whole := mug.page.get_by_role("button", name="Whole")).is_visible():
        whole.click()
    if (show := mug.page.get_by_role("button", name="Show outline")).is_visible():
        show.click()
    expected = mug.silhouette(HELD_IN_VIEW).nonzero()
    middle = np.mean(expected, axis=1)[::-1]
    wait_until(lambda: np.linalg.norm(mug.place - middle) < 5, "the outline")
    return mug


def test_what_is_drawn_is_what_the_library_renders(image: ImagePanel) -> None:
    image.blend(1.0)
    expected = image.silhouette(HELD_IN_VIEW)
    assert expected.sum() > 500
    wait_until(lambda: image.overlap(expected) > 0.97, "the object where the library renders it", 20)
    image.page.keyboard.press("z")
    wait_until(lambda: image.view.scale > 1, "the image zoomed in")
    expected = image.silhouette(HELD_IN_VIEW)
    assert expected.sum() > 5000
    wait_until(lambda: image.overlap(expected) > 0.99, "the same, zoomed in", 20)
    rows, columns = np.nonzero(expected)
    assert np.allclose(image.place, [columns.mean(), rows.mean()], atol=0.25)


def test_the_outline_goes_with_a_drag_while_it_lasts(image: ImagePanel) -> None:
    labelling, page = image.labelling, image.page
    assert page.request.post(f"{labelling.url}/reset").ok
    wait_for_picture(labelling.frame)
    first = image.silhouette(np.array(labelling.state["T_camera_object"])).nonzero()
    wait_until(lambda: np.linalg.norm(image.place - np.mean(first, axis=1)[::-1]) < 5, "the start pose")
    before = image.place
    start, end = labelling.take_hold("tz", 0.08)
    for share in (0.3, 0.6, 1.0):
        page.mouse.move(*(start + share * (end - start)))
    wait_until(lambda: np.linalg.norm(image.place - before) > 10, "the outline on its way")
    assert labelling.state["dragging"]
    take_picture(page, "label-outline-in-a-drag")
    page.mouse.up()
    labelling.events("drag")
    image.blend(1.0)
    expected = image.silhouette(np.array(labelling.state["T_camera_object"]))
    wait_until(lambda: image.overlap(expected) > 0.95, "the outline where the drag ended", 20)


def test_blend_goes_from_the_outline_alone_to_the_shape(image: ImagePanel) -> None:
    image.page.keyboard.press("z")
    wait_until(lambda: image.view.scale > 1, "the image zoomed in")
    wide = image.silhouette(HELD_IN_VIEW)
    rows, columns = np.nonzero(wide)
    inside = (int(rows.mean()) + 30, int(columns.mean()))
    assert wide[inside]

    def is_about(alpha: int) -> bool:
        return abs(int(image.pixels[inside][3]) - alpha) <= 2

    seen = []
    for share in (0.0, 0.5, 1.0):
        image.blend(share)
        wanted = round(255 * share)
        wait_until(partial(is_about, wanted), f"blend {share}")
        seen.append((image.pixels[..., 3] > COVERED).sum())
        take_picture(image.page, f"label-outline-blend-{share}")
    assert 100 < seen[0] < 0.2 * wide.sum() < seen[2]


def test_a_key_hides_the_outline_wherever_the_focus_is(image: ImagePanel) -> None:
    page = image.page
    outline = page.locator("#outline")
    page.locator("#blend").focus()
    page.keyboard.press("h")
    expect(outline).to_be_hidden()
    expect(page.get_by_role("button", name="Show outline")).to_be_visible()
    page.locator("#view").focus()
    page.keyboard.press("h")
    expect(outline).to_be_visible()
    page.get_by_role("button", name="Hide outline").click()
    expect(outline).to_be_hidden()


def test_zoom_by_wheel_buttons_and_keys(image: ImagePanel) -> None:
    page = image.page
    whole = image.view
    box = page.locator("#image").bounding_box()
    assert box is not None
    x, y = round(0.7 * box["width"]), round(0.4 * box["height"])
    page.mouse.move(box["x"] + x, box["y"] + y)
    page.mouse.wheel(0, -300)
    wait_until(lambda: image.view.scale > 2 * whole.scale, "the image zoomed in")
    near = image.view
    assert (x - near.left) / near.scale == pytest.approx((x - whole.left) / whole.scale, abs=0.5)
    assert (y - near.top) / near.scale == pytest.approx((y - whole.top) / whole.scale, abs=0.5)
    before = image.place
    page.mouse.down()
    page.mouse.move(box["x"] + x - 30, box["y"] + y + 20, steps=3)
    page.mouse.up()
    panned = image.view
    assert (panned.left - near.left, panned.top - near.top) == pytest.approx((-30, 20), abs=1)
    wait_until(lambda: np.abs(image.place - before).max() > 5, "the outline with the image")
    page.get_by_role("button", name="Zoom out").click()
    assert image.view.scale == pytest.approx(panned.scale / 1.5, rel=1e-4)
    page.locator("#image").focus()
    page.keyboard.press("+")
    page.keyboard.press("ArrowRight")
    assert image.view.scale == pytest.approx(panned.scale, rel=1e-4)
    page.get_by_role("button", name="Whole").click()
    assert image.view == whole


def test_the_machine_and_the_human_have_their_colours(image: ImagePanel) -> None:
    def is_warm() -> bool:
        pixels = image.pixels
        line = pixels[pixels[..., 3] > 250].astype(int)
        return bool(np.median(line[:, 0] - line[:, 2]) > 0)

    assert is_warm()
    image.page.keyboard.press("Space")
    image.labelling.events("snap_applied")
    wait_until(lambda: not is_warm(), "the outline in the colour of the machine")
    image.page.keyboard.press("z")
    take_picture(image.page, "label-outline-snapped")


def test_every_frame_of_the_scene_has_a_thumbnail_with_the_outline(image: ImagePanel) -> None:
    page, labelling = image.page, image.labelling
    T_world_object = np.array(labelling.state["T_world_object"])

    def are_drawn() -> bool:
        thumbnails = image.drawn_on("#frame-list canvas")
        assert len(thumbnails) == len(image.frames) == 3
        for frame, seen in zip(image.frames, thumbnails, strict=True):
            height, width, _ = seen.shape
            if width < 50:
                return False
            camera = View(width / frame["width"], 0.0, 0.0).camera(frame, width, height)
            T_camera_object = pose.inverse(np.array(frame["T_world_camera"])) @ T_world_object
            expected = np.argwhere(render_depth(image.model, camera, T_camera_object) > 0)
            assert len(expected) > 20
            drawn = np.argwhere(seen[..., 3] > 128)
            if len(drawn) < 10 or np.linalg.norm(drawn.mean(axis=0) - expected.mean(axis=0)) > 2:
                return False
        return True

    wait_until(are_drawn, "the outline in every thumbnail", 20)
    first, _, third = image.frames
    current = page.locator("#frame-list [aria-current]")
    page.get_by_role("button", name=f"Show frame {third['image_id']}").click()
    wait_until(lambda: labelling.state["frame_id"] == third["id"], "the frame that was clicked")
    expect(current).to_have_accessible_name(f"Show frame {third['image_id']}")
    expect(page.locator("#frame-place")).to_have_text("3 of 3")
    expect(page.locator("#frame-next")).to_be_disabled()
    take_picture(page, "label-frames")
    page.keyboard.press(",")
    expect(page.locator("#frame-place")).to_have_text("2 of 3")
    page.get_by_role("button", name="Previous frame").click()
    expect(page.locator("#frame-place")).to_have_text("1 of 3")
    assert labelling.state["frame_id"] == first["id"]
    assert len(labelling.events("frame", 3)) == 3


def test_without_webgl_the_image_is_shown_alone(server: Server, browser: Browser) -> None:
    context = browser.new_context(viewport={"width": 1366, "height": 768}, color_scheme="dark")
    context.add_init_script(NO_WEBGL)
    try:
        page = context.new_page()
        page.goto(server.new_link("without webgl"))
        LabellingPage(page, server, "mug")
        expect(page.locator("#no-outline")).to_have_text("Without WebGL 2 no outline can be drawn.")
        expect(page.locator("#blend")).to_be_hidden()
        expect(page.locator("#color")).to_be_visible()
        take_picture(page, "label-without-webgl")
    finally:
        context.close()


def test_the_image_changes_places_with_the_view(image: ImagePanel) -> None:
    page, frame = image.page, image.labelling.frame

    def times_as_wide_as_the_view() -> float:
        image_box, view_box = (page.locator(part).bounding_box() for part in ("#image", "#view"))
        assert image_box is not None and view_box is not None
        return image_box["width"] / view_box["width"]

    before = times_as_wide_as_the_view()
    assert before < 0.5
    frame.evaluate("() => { window.isTheSame = true; }")
    page.keyboard.press("Shift+Z")
    assert times_as_wide_as_the_view() > 2
    wait_for_picture(frame)
    take_picture(page, "image-large")
    page.locator("#swap").click()
    assert times_as_wide_as_the_view() == before
    assert frame.evaluate("() => window.isTheSame")  # it was not loaded anew
