"""A trial of a study goes on through all that may happen to a browser, a login and a server."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import take_picture
from tests.e2e.gizmo import Handle, pull, take_hold, view_frame
from tests.e2e.labelling_page import scale_of_gizmo
from tests.e2e.participants import participant_link
from tests.processes import Server, serving

pytestmark = pytest.mark.e2e

SLOWEST = 60_000


def open_again(page: Page, link: str) -> Page:
    """The same participant's link in one more window."""
    other = page.context.new_page()
    other.goto(link)
    expect(other.get_by_role("link", name="Start")).to_be_visible()
    return other


def end_login(page: Page, server: Server) -> None:
    """The cookie stays with the browser, as it does when a login expires; the server knows it no more."""
    cookies: Any = page.context.cookies()  # playwright takes another type than it gives
    assert page.request.post(f"{server.url}/api/sign-out").ok
    page.context.add_cookies(cookies)


def test_a_participant_goes_on_after_another_window_a_lost_login_and_a_killed_server(
    open_page: Callable[[str], Page], tmp_path: Path
) -> None:
    with serving(tmp_path / "state", "--prepare") as server:
        admin = open_page(server.sign_in_link)
        expect(admin.locator("#account")).to_be_visible()
        link = participant_link(admin, server)
        page = open_page(link)
        page.get_by_role("button", name="Understood").click()
        pull(page, *take_hold(page, view_frame(page), Handle("tx", scale_of_gizmo(page)), 0.01))
        page.mouse.up()
        expect(page.locator("#undo")).to_be_enabled()
        task_url = page.url

        other = open_again(page, link)
        other.get_by_role("link", name="Start").click()
        expect(page.locator("#closed")).to_contain_text("opened in another tab", timeout=SLOWEST)
        expect(other.locator("#undo")).to_be_enabled(timeout=SLOWEST)  # what was done is there
        page.get_by_role("button", name="Continue here instead").click()
        expect(other.locator("#closed")).to_contain_text("opened in another tab", timeout=SLOWEST)
        other.close()
        view_frame(page)
        expect(page.locator("#undo")).to_be_enabled(timeout=SLOWEST)

        end_login(page, server)
        page.locator("#undo").click()
        dialog = page.locator("#sign-in-again")
        expect(dialog).to_contain_text("Open your link of the study in another tab")
        expect(dialog.get_by_label("Password")).to_be_hidden()
        take_picture(page, "study-sign-in-again")
        open_again(page, link).close()
        dialog.get_by_role("button", name="I have signed in there").click()
        expect(dialog).to_be_hidden()
        expect(page.locator("#redo")).to_be_enabled()
        server.kill()

    expect(page.locator("#connection")).to_be_visible()
    with serving(server.state_dir, "--port", server.url.rsplit(":", 1)[1]):
        expect(page.locator("#connection")).to_be_hidden()
        page.locator("#redo").click()
        expect(page.locator("#undo")).to_be_enabled()
        page.reload()
        assert page.url == task_url
        expect(page.locator("#undo")).to_be_enabled(timeout=SLOWEST)
        page.keyboard.press("Enter")
        expect(page.get_by_role("heading", name="Thank you!")).to_be_visible()
        other = page.context.new_page()
        other.goto(task_url)  # by hand, from the history: there is nothing to do again
        expect(other.get_by_role("heading", name="Thank you!")).to_be_visible()
