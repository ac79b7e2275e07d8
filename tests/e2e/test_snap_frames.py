"""Snap with the frames that see the object, or with the one that is shown alone."""

import re
from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import take_picture
from tests.e2e.labelling_page import LabellingPage, OpenLabelling
from tests.processes import Server, serving

pytestmark = pytest.mark.e2e


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server that nobody else has used: what others submit in a scene explains measured points."""
    with serving(tmp_path_factory.mktemp("frames"), "--prepare") as running:
        yield running


def test_a_snap_says_how_many_frames_it_used_and_a_key_keeps_it_to_one(open_labelling: OpenLabelling) -> None:
    labelling = open_labelling("snap")
    page = labelling.page
    only, status = page.locator("#this-frame-only"), page.locator("#snap-status")
    expect(only).to_have_attribute("aria-pressed", "false")
    page.keyboard.press("Space")
    expect(status).to_contain_text(re.compile(r"confidence [01]\.\d\d · 2 frames, 1 of 1 other agrees\."))
    take_picture(page, "snap-frames")

    page.keyboard.press("Shift+T")
    expect(only).to_have_attribute("aria-pressed", "true")
    page.keyboard.press("Space")
    expect(status).to_contain_text("1 frame, 2 of 2 others agree")
    take_picture(page, "snap-frames-one")
    used = [event["detail"]["used_frames"] for event in labelling.events("snap_requested", 2)]
    assert [len(frames) for frames in used] == [2, 1]

    assert page.request.put(f"{labelling.url}/snap-frames", data={"frames": "auto"}).ok
    expect(only).to_have_attribute("aria-pressed", "false")
    page.reload()
    expect(only).to_have_attribute("aria-pressed", "true")  # as the browser remembers

    labelling.submit()
    page.locator("#replay").click()
    applied = page.locator("#events li").filter(has_text="Snap applied")
    expect(applied.nth(0)).to_contain_text("2 frames, 1 of 1 other agrees")
    expect(applied.nth(1)).to_contain_text("1 frame, 2 of 2 others agree")
    take_picture(page, "snap-frames-replay")


def test_a_compared_technique_has_no_choice_of_frames(
    server: Server, open_page: Callable[[str], Page]
) -> None:
    labelling = LabellingPage(open_page(server.new_link("one frame", "admin")), server, "box", "live snap")
    expect(labelling.page.locator("#undo")).to_be_visible()
    expect(labelling.page.locator("#this-frame-only")).to_be_hidden()
