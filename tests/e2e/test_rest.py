"""REST can be read and tried out in the browser, with nothing from elsewhere."""

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import take_picture
from tests.processes import Server

pytestmark = pytest.mark.e2e


def test_rest_can_be_tried_out_with_ones_own_login(server: Server, open_page: Callable[[str], Page]) -> None:
    page = open_page(server.new_link("tinkerer"))
    page.wait_for_url(f"{server.url}/")
    asked: list[str] = []
    complaints: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("console", lambda message: complaints.append(message.text))  # what the policy refuses, for one
    page.goto(f"{server.url}/api/docs")
    call = page.locator(".opblock", has_text="/api/me")
    call.get_by_role("button").first.click()
    call.get_by_role("button", name="Try it out").click()
    call.get_by_role("button", name="Execute").click()
    expect(call.locator(".live-responses-table")).to_contain_text('"name": "tinkerer"')
    take_picture(page, "rest")
    assert complaints == []
    assert not [url for url in asked if not url.startswith((server.url, "data:"))]
