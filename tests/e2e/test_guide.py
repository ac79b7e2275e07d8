"""The first task, step by step, for somebody new."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from tests.e2e.conftest import take_picture
from tests.e2e.labelling_page import LabellingPage
from tests.processes import Server

pytestmark = pytest.mark.e2e

SLOWEST = 60_000
OUTLINE_DRAWN = "() => document.getElementById('outline').width !== 300"
"""A canvas has this width until something is drawn on it."""


@pytest.fixture
def context(browser: Browser) -> Iterator[BrowserContext]:
    """A browser that has never seen the guide."""
    context = browser.new_context(viewport={"width": 1366, "height": 768}, reduced_motion="reduce")
    context.set_default_timeout(SLOWEST)
    yield context
    context.close()


def newcomer_s_page(context: BrowserContext, server: Server, name: str) -> Page:
    """The labelling page that a new operator sees first."""
    page = context.new_page()
    page.goto(server.new_link(name))
    return LabellingPage(page, server).page


def test_a_new_operator_is_shown_around_once(server: Server, context: BrowserContext) -> None:
    page = context.new_page()
    page.goto(server.new_link("newcomer"))
    labelling = LabellingPage(page, server)
    card, text = page.locator("#guide"), page.locator("#guide-text")
    place = page.locator("#guide-place")

    expect(text).to_contain_text("Drag one of the object's arrows")
    expect(place).to_have_text("1 of 7")
    take_picture(page, "label-guide")
    labelling.drag("tx", 0.02)
    expect(text).to_contain_text("Turn the view")
    page.mouse.move(850, 560)
    page.mouse.down()
    page.mouse.move(930, 540, steps=6)
    page.mouse.up()
    expect(text).to_contain_text("Space: the machine")
    take_picture(page, "label-guide-snap")
    page.keyboard.press("Space")
    expect(text).to_contain_text("the outline follows the edge", timeout=SLOWEST)
    page.reload()  # it is remembered how far they were
    expect(text).to_contain_text("the outline follows the edge", timeout=SLOWEST)
    expect(page.locator("#undo")).to_be_enabled(timeout=SLOWEST)
    page.wait_for_function(OUTLINE_DRAWN)
    page.keyboard.press("z")
    expect(text).to_contain_text("can be undone")
    page.keyboard.press("Control+z")
    expect(text).to_contain_text("it comes back")
    page.keyboard.press("Control+Shift+z")
    expect(text).to_contain_text("to submit it")
    expect(place).to_have_text("7 of 7")
    page.keyboard.press("Enter")
    expect(text).to_contain_text("That is all you need", timeout=SLOWEST)
    take_picture(page, "label-guide-end")
    page.locator("#next-task").click()
    expect(page.locator("#undo")).to_be_attached()
    expect(page.locator("#saved")).to_contain_text("saved", timeout=SLOWEST)
    expect(card).to_be_hidden()

    page.keyboard.press("?")
    page.get_by_role("button", name="Show me around").click()
    expect(card).to_be_visible()
    page.locator("#guide-skip").click()
    expect(card).to_be_hidden()


def test_the_first_steps_end_for_who_works_by_keys(server: Server, context: BrowserContext) -> None:
    page = newcomer_s_page(context, server, "newcomer by keys")
    text, place, keys = page.locator("#guide-text"), page.locator("#guide-place"), page.keyboard

    expect(text).to_contain_text("Or press J L I K U O")
    take_picture(page, "label-guide-keys")
    keys.press("l")
    expect(text).to_contain_text("Turn the view")
    keys.press("9")
    expect(text).to_contain_text("Space: the machine")
    keys.press("Space")
    expect(text).to_contain_text("Press Z", timeout=SLOWEST)
    page.wait_for_function(OUTLINE_DRAWN)
    keys.press("z")
    expect(text).to_contain_text("can be undone")
    keys.press("Control+z")
    expect(text).to_contain_text("it comes back")
    keys.press("Control+Shift+z")
    expect(text).to_contain_text("to submit it")
    keys.press("Enter")
    expect(place).to_have_text("Done", timeout=SLOWEST)
    expect(page.locator("#next-task")).to_be_visible()


@pytest.mark.parametrize("key", ["w", "ArrowLeft"])
def test_the_camera_s_own_keys_turn_the_view_too(server: Server, context: BrowserContext, key: str) -> None:
    page = newcomer_s_page(context, server, f"newcomer who flies by {key}")
    page.keyboard.press("Shift+l")
    expect(page.locator("#guide-text")).to_contain_text("Turn the view")
    page.keyboard.press(key)
    expect(page.locator("#guide-text")).to_contain_text("Space: the machine")


def test_a_snap_moves_the_object_too(server: Server, context: BrowserContext) -> None:
    page = newcomer_s_page(context, server, "newcomer who snaps first")
    expect(page.locator("#guide-place")).to_have_text("1 of 7")
    page.keyboard.press("Space")
    expect(page.locator("#guide-text")).to_contain_text("Turn the view", timeout=SLOWEST)
