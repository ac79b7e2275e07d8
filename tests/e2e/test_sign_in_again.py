"""A login that ends in the middle of the work: sign in again in place, and go on."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import take_picture
from tests.e2e.gizmo import expect_new_view, view_frame
from tests.e2e.labelling_page import LabellingPage
from tests.processes import Server, run_snap6d

pytestmark = pytest.mark.e2e

SLOWEST = 60_000
PASSWORD = "correct horse battery"


def end_login(labelling: LabellingPage) -> None:
    """The cookie stays with the browser, as it does when a login expires; the server knows it no more.

    The 3-D view loses its connection with it, and gets another one once somebody is signed in again.
    """
    expect_new_view(labelling.frame)
    cookies: Any = labelling.page.context.cookies()  # playwright takes another type than it gives
    assert labelling.page.request.post(f"{labelling.root}/api/sign-out").ok
    labelling.page.context.add_cookies(cookies)


def secret_in(printed: str) -> str:
    """Of the sign-in link that a command printed."""
    return printed.strip().rsplit("#", 1)[1]


def test_a_login_that_ended_is_renewed_in_place(server: Server, open_page: Callable[[str], Page]) -> None:
    typed = f"{PASSWORD}\n{PASSWORD}\n"
    added = run_snap6d(server.state_dir, "user", "add", "expired", "--password", typed=typed).stdout
    labelling = LabellingPage(open_page(f"{server.url}/sign-in#{secret_in(added)}"), server)
    page, start = labelling.page, labelling.pose
    dialog = page.locator("#sign-in-again")
    labelling.drag("tx", 0.02)
    end_login(labelling)
    page.keyboard.press("Control+z")
    expect(dialog).to_be_visible()
    expect(dialog.get_by_label("Name")).to_have_value("expired")
    page.keyboard.press("Escape")
    dialog.get_by_label("Password").fill("not this one")
    page.keyboard.press("Enter")
    expect(dialog).to_contain_text("do not belong together")
    take_picture(page, "label-sign-in-again")
    dialog.get_by_role("button", name="I have signed in there").click()
    expect(dialog).to_contain_text("Nobody is signed in yet")

    stranger = page.context.new_page()
    stranger.goto(server.new_link("somebody-else"))
    stranger.wait_for_url(f"{server.url}/", wait_until="commit", timeout=SLOWEST)
    dialog.get_by_role("button", name="I have signed in there").click()
    expect(dialog).to_contain_text("You are somebody-else now; this is the work of expired")

    stranger.goto(f"{server.url}/sign-in#{secret_in(server.command('user', 'link', 'expired'))}")
    stranger.wait_for_url(f"{server.url}/", wait_until="commit", timeout=SLOWEST)
    stranger.close()
    page.bring_to_front()
    dialog.get_by_role("button", name="I have signed in there").click()
    expect(dialog).to_be_hidden()
    labelling.frame = view_frame(page)
    labelling.events("undo")  # what was asked for when the login had ended
    assert np.allclose(labelling.pose, start)

    expect(page.locator("#connection")).to_be_hidden()
    end_login(labelling)
    page.keyboard.press("Control+Shift+z")
    dialog.get_by_label("Password").fill(PASSWORD)
    page.keyboard.press("Enter")
    expect(dialog).to_be_hidden()
    labelling.events("redo")
    labelling.frame = view_frame(page)
    labelling.drag("tz", 0.02)


def test_the_stream_notices_that_the_login_ended(server: Server, open_page: Callable[[str], Page]) -> None:
    labelling = LabellingPage(open_page(server.sign_in_link), server)
    end_login(labelling)
    expect(labelling.page.locator("#sign-in-again")).to_be_visible(timeout=SLOWEST)
