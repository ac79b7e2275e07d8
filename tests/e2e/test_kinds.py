"""Tasks of one thing in several modes and conditions: told apart on their cards, chosen by a filter."""

from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import take_picture
from tests.processes import serving

pytestmark = pytest.mark.e2e


def test_cards_tell_mode_and_condition_where_they_differ(
    open_page: Callable[[str], Page], tmp_path: Path
) -> None:
    with serving(tmp_path / "state", "--prepare") as server:
        page = open_page(server.sign_in_link)
        cards, kinds = page.locator("[data-task-id]"), page.locator(".card-kinds > *")
        expect(cards).to_have_count(20)
        expect(kinds.filter(visible=True)).to_have_count(0)
        expect(page.get_by_label("Mode")).to_be_hidden()
        expect(page.get_by_label("Condition")).to_be_hidden()

        task = page.request.get(f"{server.url}/api/tasks").json()["items"][0]
        thing = {"scene_id": task["scene"]["id"], "object_id": task["object"]["id"]}
        for more in ({"condition": "manual"}, {"condition": "manual", "mode": "quick"}):
            assert page.request.post(f"{server.url}/api/tasks", data={**thing, **more}).ok
        page.reload()
        expect(cards).to_have_count(22)
        expect(cards.first).to_contain_text("accurate")
        expect(cards.last).to_contain_text("quick")
        expect(cards.last).to_contain_text("manual")
        take_picture(page, "home-kinds")

        page.get_by_label("Condition").select_option("manual")
        expect(cards).to_have_count(2)
        expect(page.get_by_text("manual", exact=True).filter(visible=True)).to_have_count(0)  # alike in this
        page.get_by_label("Mode").select_option("quick")
        expect(cards).to_have_count(1)
        expect(kinds.filter(visible=True)).to_have_count(0)
        assert page.url.endswith("?mode=quick&condition=manual")
        page.reload()
        expect(cards).to_have_count(1)
        expect(page.get_by_label("Mode")).to_have_value("quick")
        expect(page.get_by_label("Condition")).to_have_value("manual")
        expect(cards.first).to_have_attribute("href", f"/label/{task_id(page)}?mode=quick&condition=manual")
        page.get_by_label("Mode").select_option("accurate")
        page.get_by_role("radio", name="Submitted").check()
        page.get_by_role("button", name="Show all tasks").click()
        expect(cards).to_have_count(22)
        page.goto("about:blank")  # before the server ends


def task_id(page: Page) -> str | None:
    """Of the first card."""
    return page.locator("[data-task-id]").first.get_attribute("data-task-id")
