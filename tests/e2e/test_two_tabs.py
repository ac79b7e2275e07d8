"""One registration in two tabs: the newer one takes over, and the older says so."""

from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import take_picture
from tests.e2e.gizmo import view_frame
from tests.e2e.labelling_page import LabellingPage
from tests.processes import Server

pytestmark = pytest.mark.e2e

SLOWEST = 60_000
"""Milliseconds in which a second page may open on a machine that is busy with others."""


def test_the_newer_tab_takes_over(server: Server, open_page: Callable[[str], Page]) -> None:
    older = LabellingPage(open_page(server.new_link("two-tabs")), server)
    kept = older.drag("tx", 0.02)["T_after"]
    newer = older.page.context.new_page()
    newer.goto(older.page_url)
    expect(older.page.locator("#closed")).to_contain_text("opened in another tab", timeout=SLOWEST)
    expect(older.page.locator("#view")).to_have_count(0, timeout=SLOWEST)
    take_picture(older.page, "label-taken-by-another-tab")
    view_frame(newer)
    newer.locator("#undo").click()
    older.events("undo")
    newer.keyboard.press("Control+Shift+z")
    older.events("redo")
    assert np.allclose(older.pose, kept)
    older.page.get_by_role("button", name="Continue here instead").click()
    expect(newer.locator("#closed")).to_contain_text("opened in another tab", timeout=SLOWEST)
    view_frame(older.page)
    expect(older.page.locator("#undo")).to_be_enabled(timeout=SLOWEST)
