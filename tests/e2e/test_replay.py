"""A registration made with mouse and keys, played back from its log."""

from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import take_picture
from tests.e2e.gizmo import place_of_object, view_frame, wait_for_object
from tests.e2e.labelling_page import LabellingPage
from tests.processes import Server

pytestmark = pytest.mark.e2e

PATIENCE = 60_000
"""Milliseconds."""


@pytest.fixture
def labelling(server: Server, open_page: Callable[[str], Page]) -> LabellingPage:
    """A registration that was dragged, looked at from the top, snapped, undone and submitted."""
    labelling = LabellingPage(open_page(server.new_link("operator of the replay")), server, "mug")
    page = labelling.page
    labelling.drag("tx", 0.04)
    views = len(labelling.events("view"))
    page.keyboard.press("6")
    labelling.events("view", views + 1)
    page.keyboard.press("Space")
    labelling.events("snap_applied")
    page.keyboard.press("Control+z")
    labelling.events("undo")
    expect(page.locator("#submit")).to_be_enabled()  # the page has heard that the snap has ended
    labelling.submit_unsure()
    return labelling


def go_to(page: Page, share: float) -> float:
    """Click the time line there; returns the time, seconds."""
    box = page.locator("#plot").bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + share * box["width"], box["y"] + box["height"] / 2)
    return page.locator("#scrub").evaluate("node => node.valueAsNumber")


def test_a_registration_is_played_back_from_its_log(
    labelling: LabellingPage, server: Server, open_page: Callable[[str], Page]
) -> None:
    page = labelling.page
    page.locator("#replay").click()
    page.wait_for_url("**/replay/*")
    frame = view_frame(page)
    start = place_of_object(frame)
    trace = page.request.get(f"{labelling.url}/trace").json()
    (drag,) = labelling.events("drag")
    (span,) = (event for event in trace["events"] if event["kind"] == "drag")

    seconds = go_to(page, (span["start"] + span["end"]) / 2 / trace["seconds"])
    path = np.array(drag["path"])
    origin = [np.interp(seconds - span["start"], path[:, 0], column) for column in path[:, 1:4].T]
    wait_for_object(frame, start + origin - np.array(drag["T_before"])[:3, 3])
    take_picture(page, "replay-drag")

    page.locator("#events button", has_text="Snap applied").click()
    expect(page.locator("#ghost")).to_contain_text("Put here by the machine", timeout=PATIENCE)
    page.emulate_media(color_scheme="dark")
    take_picture(page, "replay-dark")
    page.keyboard.press(".")
    expect(page.locator("#events [aria-current]")).to_contain_text("Undo", timeout=PATIENCE)
    expect(page.locator("#ghost")).to_be_hidden(timeout=PATIENCE)
    page.keyboard.press(".")
    expect(page.locator("#events [aria-current]")).to_contain_text("Submitted", timeout=PATIENCE)
    expect(page.locator("#distance")).to_have_text("0.0 mm · 0.0° to the end", timeout=PATIENCE)
    (submitted,) = labelling.events("submit")
    submitted_origin = np.array(submitted["T_after"])[:3, 3]
    wait_for_object(frame, start + submitted_origin - np.array(drag["T_before"])[:3, 3])

    page.keyboard.press("Space")  # from the end it begins anew
    expect(page.locator("#play-text")).to_have_text("Pause", timeout=PATIENCE)
    expect(page.locator("#events [aria-current]")).to_contain_text("Opened", timeout=PATIENCE)
    page.wait_for_function("() => document.getElementById('scrub').valueAsNumber > 0.2")
    page.keyboard.press("Space")
    expect(page.locator("#play-text")).to_have_text("Play", timeout=PATIENCE)

    page.set_viewport_size({"width": 1920, "height": 1080})
    page.emulate_media(color_scheme="light")
    page.locator("#events button", has_text="Snap applied").click()
    expect(page.locator("#ghost")).to_be_visible(timeout=PATIENCE)
    take_picture(page, "replay-large")

    other = open_page(server.new_link("somebody else"))
    other.wait_for_url(f"{server.url}/")
    other.goto(page.url)
    expect(other.locator("#closed")).to_contain_text("no registration", timeout=PATIENCE)
