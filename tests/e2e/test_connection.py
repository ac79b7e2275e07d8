"""Connections that break, one by one and together: it is said, they come again, and nothing is lost."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from app.labeling.session import BROKEN_DRAG
from tests.e2e.breakable import BreakableWay, breakable_way
from tests.e2e.conftest import take_picture
from tests.e2e.gizmo import expect_new_view, view_frame
from tests.e2e.labelling_page import LabellingPage, hold
from tests.processes import Server

pytestmark = pytest.mark.e2e

SLOWEST = 60_000
VIEW = b"upgrade: websocket"
"""Only the 3-D view has one."""


@pytest.fixture
def way(server: Server) -> Iterator[BreakableWay]:
    with breakable_way(int(server.url.rsplit(":", 1)[1])) as opened:
        yield opened


@pytest.fixture
def labelling(way: BreakableWay, server: Server, open_page: Callable[[str], Page], request) -> LabellingPage:
    behind = replace(server, url=way.url)
    return LabellingPage(open_page(behind.new_link(request.node.name.replace("_", "-")[:60])), behind)


def test_a_view_that_lost_its_connection_gets_another(labelling: LabellingPage, way: BreakableWay) -> None:
    page = labelling.page
    kept = labelling.drag("tx", 0.02)["T_after"]
    page.locator("#undo").focus()  # away from the view, which reconnects only while it has the focus
    expect_new_view(labelling.frame)
    way.refused = VIEW
    assert way.cut(VIEW)
    expect(page.locator("#view-lost")).to_be_visible(timeout=SLOWEST)
    expect(page.locator("#connection")).to_be_hidden()
    take_picture(page, "label-view-lost")
    page.keyboard.press("Control+z")
    labelling.events("undo")
    way.refused = None
    expect(page.locator("#view-lost")).to_be_hidden(timeout=SLOWEST)
    labelling.frame = view_frame(page)
    page.keyboard.press("Control+Shift+z")
    labelling.events("redo")
    assert np.allclose(labelling.pose, kept)
    labelling.drag("tz", 0.02)


def test_a_drag_that_the_connection_breaks_is_kept_and_told(
    labelling: LabellingPage, way: BreakableWay
) -> None:
    page, start = labelling.page, labelling.pose
    hold(labelling, "ty", 0.03)
    expect(page.locator("#saved")).to_contain_text("moving")
    expect_new_view(labelling.frame)
    way.refused = b""
    way.cut(b"")
    expect(page.locator("#connection")).to_be_visible(timeout=SLOWEST)
    page.mouse.up()
    way.refused = None
    expect(page.locator("#connection")).to_be_hidden(timeout=SLOWEST)
    (drag,) = labelling.events("drag")
    expect(page.locator("#message")).to_have_text(BROKEN_DRAG, timeout=SLOWEST)
    labelling.frame = view_frame(page)
    take_picture(page, "label-broken-drag")
    assert np.allclose(labelling.pose, drag["T_after"]) and not np.allclose(labelling.pose, start)
    page.keyboard.press("Control+z")
    labelling.events("undo")
    assert np.allclose(labelling.pose, start)
    expect(page.locator("#message")).to_be_hidden()
    labelling.drag("tx", 0.02)


def test_the_page_goes_on_when_the_network_comes_back(labelling: LabellingPage) -> None:
    page = labelling.page
    kept = labelling.drag("tx", 0.02)["T_after"]
    page.context.set_offline(True)
    page.locator("#undo").click()
    expect(page.locator("#message")).to_contain_text("cannot be reached")
    page.context.set_offline(False)
    expect(page.locator("#connection")).to_be_hidden(timeout=SLOWEST)
    expect(page.locator("#undo")).to_be_enabled(timeout=SLOWEST)
    assert np.allclose(labelling.pose, kept)
    labelling.drag("tz", 0.02)
