"""How the labelling page looks: small and large, light and dark, without colour, and to a screen reader."""

from collections.abc import Callable

import pytest
from playwright.sync_api import Page

from tests.e2e.conftest import drawing_finely, take_picture
from tests.e2e.labelling_page import LabellingPage
from tests.e2e.page_rules import NAMELESS
from tests.processes import Server

pytestmark = pytest.mark.e2e

SIZES = [(1366, 768), (1920, 1080), (2560, 1440)]
FITS = """() => {
  const root = document.documentElement, side = document.querySelector(".side");
  const around = side.getBoundingClientRect();
  const isCut = node => {
    const { width, left, right } = node.getBoundingClientRect();
    return width && !node.closest(".settings") && (left < around.left - 1 || right > around.right + 1);
  };
  return {
    scrolls: root.scrollHeight > root.clientHeight
      || [root, side].some(node => node.scrollWidth > node.clientWidth),
    panelScrolls: side.scrollHeight > side.clientHeight,
    cut: [...side.querySelectorAll("button, input, h2, p")].filter(isCut).map(node => node.outerHTML),
  };
}"""


def test_it_fits_small_and_large_screens_and_names_everything(
    server: Server, open_page: Callable[[str], Page]
) -> None:
    labelling = LabellingPage(drawing_finely(open_page(server.new_link("looks"))), server)
    page = labelling.page
    labelling.drag("tx", 0.02)
    page.keyboard.press("Space")
    labelling.events("snap_applied")
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        for width, height in SIZES:
            page.set_viewport_size({"width": width, "height": height})
            assert page.evaluate(FITS) == {"scrolls": False, "panelScrolls": False, "cut": []}, width
            take_picture(page, f"label-{scheme}-{width}")
    seen = page.locator("body").aria_snapshot()
    assert [line for line in seen.splitlines() if NAMELESS.match(line)] == []
    page.set_viewport_size({"width": 1366, "height": 768})
    blind = page.context.new_cdp_session(page)
    blind.send("Emulation.setEmulatedVisionDeficiency", {"type": "deuteranopia"})
    take_picture(page, "label-deuteranopia")


def test_a_panel_with_more_in_it_scrolls_in_itself(server: Server, open_page: Callable[[str], Page]) -> None:
    page = LabellingPage(open_page(server.new_link("more-rows")), server).page
    more = "document.querySelector('.{}').append(...Array.from({{length: 6}}, () => " + (
        "Object.assign(document.createElement('p'), {{ textContent: 'One more row', className: 'panel' }})))"
    )
    for place in ("readings", "actions"):
        page.evaluate(more.format(place))
        found = page.evaluate(FITS)
        assert not found["scrolls"] and found["cut"] == [], place
        page.locator("#submit").scroll_into_view_if_needed()
        take_picture(page, f"label-more-in-{place}")
