"""The focus: its ring is seen on light and dark, Esc leads it to the 3-D view, and a notice keeps it."""

from collections.abc import Callable
from typing import Literal

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import take_picture
from tests.e2e.gizmo import view_frame
from tests.e2e.labelling_page import LabellingPage
from tests.processes import Server

pytestmark = pytest.mark.e2e

LEAST_CONTRAST = 3.0
"""Of the ring to what it is drawn on, as WCAG 2.2 asks for parts of an interface."""
CONTRAST = """node => {
  const context = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = color => {
    context.clearRect(0, 0, 1, 1);
    context.fillStyle = color;
    context.fillRect(0, 0, 1, 1);
    return [...context.getImageData(0, 0, 1, 1).data];
  };
  const luminance = color => {
    const linear = v => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
    const [r, g, b] = color.map(v => linear(v / 255));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  let behind = node.parentElement;
  while (rgba(getComputedStyle(behind).backgroundColor)[3] < 128) behind = behind.parentElement;
  const [one, other] = [getComputedStyle(node).outlineColor, getComputedStyle(behind).backgroundColor]
    .map(color => luminance(rgba(color)))
    .toSorted((a, b) => b - a);
  return (one + 0.05) / (other + 0.05);
}"""
PARTS = ("#help", "[data-layer=cloud]", "[data-look=top]", "#zoom-in", "#submit", "#frame-next")
HAS_FOCUS = "id => document.activeElement.id === id"


@pytest.fixture
def labelling(
    server: Server, open_page: Callable[[str], Page], request: pytest.FixtureRequest
) -> LabellingPage:
    """A task whose page has said that all is there."""
    labelling = LabellingPage(open_page(server.new_link(request.node.name[:50])), server)
    expect(labelling.page.locator("#submit")).to_be_enabled()
    return labelling


def test_the_ring_is_seen_wherever_it_is(labelling: LabellingPage) -> None:
    page = labelling.page
    page.keyboard.press("Shift")  # the keyboard is in use
    schemes: tuple[Literal["light", "dark"], ...] = ("light", "dark")
    for scheme in schemes:
        page.emulate_media(color_scheme=scheme)
        for selector in PARTS:
            node = page.locator(selector)
            node.focus()
            assert node.evaluate(CONTRAST) >= LEAST_CONTRAST, (scheme, selector)
        take_picture(page, f"focus-{scheme}")


def test_the_view_shows_that_it_has_the_focus_and_esc_leads_to_it(labelling: LabellingPage) -> None:
    page = labelling.page
    ring = "() => getComputedStyle(document.querySelector('.stage'), '::after').borderTopStyle"
    page.locator("#reset").focus()
    page.locator("#help").focus()
    assert page.evaluate(ring) == "none"
    page.keyboard.press("Escape")
    page.wait_for_function(HAS_FOCUS, arg="view")
    assert page.evaluate(ring) == "solid"
    take_picture(page, "focus-view")


def test_what_lies_behind_a_notice_cannot_be_reached(labelling: LabellingPage) -> None:
    page, other = labelling.page, labelling.page.context.new_page()
    other.goto(labelling.page_url)
    view_frame(other)
    page.bring_to_front()
    expect(page.locator("#closed")).to_be_visible(timeout=60_000)
    page.wait_for_function(HAS_FOCUS, arg="closed-retry")
    reached = set()
    for _ in range(12):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("() => document.activeElement.closest('.top, #closed, body').className"))
    assert reached <= {"top", "veil", ""}
    expect(page.locator(".side")).to_have_attribute("inert", "")
    take_picture(page, "focus-notice")
