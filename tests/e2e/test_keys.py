"""The keys: each in the help, none twice, none of the camera's, and working wherever the focus is."""

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import take_picture
from tests.e2e.labelling_page import LabellingPage
from tests.processes import Server

pytestmark = pytest.mark.e2e

CAMERA = {*"WASDQE", "ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight"}
"""viser's."""
OURS = {"Control": "Mod", "Plus": "+"}
"""Names of `aria-keyshortcuts` that the bindings call otherwise."""
BOUND = 'rows => rows.map(row => [row.dataset.keys.split(" "), row.textContent.trim()])'
ANNOUNCED = 'nodes => nodes.map(node => node.getAttribute("aria-keyshortcuts"))'


def test_every_key_is_in_the_help_and_its_own(server: Server, open_page: Callable[[str], Page]) -> None:
    page = LabellingPage(open_page(server.new_link("keys")), server).page
    page.keyboard.press("?")
    rows = page.locator("#key-list [data-keys]")
    bound = rows.evaluate_all(BOUND)
    chords = [chord for keys, _ in bound for chord in keys]
    assert len(chords) > 30
    assert len(set(chords)) == len(chords)
    assert all(text for _, text in bound)
    assert not CAMERA & {chord.removeprefix("Shift+") for chord in chords}
    announced = page.locator("[aria-keyshortcuts]").evaluate_all(ANNOUNCED)
    wanted = {"+".join(OURS.get(part, part) for part in one.split("+")) for one in announced}
    assert wanted <= set(chords)
    take_picture(page, "label-keys")
    page.get_by_label("Search the keys").fill("undo")
    expect(rows.filter(visible=True)).to_have_count(1)
    page.keyboard.press("Escape")
    page.keyboard.press("Escape")
    expect(page.locator("dialog#keys")).to_be_hidden()


def test_keys_work_wherever_the_focus_is(server: Server, open_page: Callable[[str], Page]) -> None:
    labelling = LabellingPage(open_page(server.new_link("focus")), server)
    page = labelling.page
    outline = page.locator("#outline")
    field = page.get_by_label("Position x, millimetres")
    places = {
        "a button that was clicked": lambda: page.locator("#zoom-fit").click(),
        "a button reached by Tab": lambda: page.locator("#reset").focus(),
        "the image": lambda: page.locator("#image").focus(),
        "the slider": lambda: page.locator("#blend").focus(),
        "the 3-D view": lambda: page.mouse.click(850, 560),
    }
    for go in places.values():
        go()
        page.keyboard.press("h")
        expect(outline).to_be_hidden()
        page.keyboard.press("h")
        expect(outline).to_be_visible()
    field.focus()
    page.keyboard.press("h")
    expect(outline).to_be_visible()
    expect(field).to_have_value("h")
