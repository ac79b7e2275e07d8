"""The paper's filter as a choice: for a task, on the labelling page, and read again in the replay."""

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from app.storage.tables import Condition
from tests.e2e.conftest import take_picture
from tests.e2e.labelling_page import LabellingPage, OpenLabelling
from tests.processes import Server

pytestmark = pytest.mark.e2e


def test_the_papers_filter_is_chosen_cancelled_and_waited_for(open_labelling: OpenLabelling) -> None:
    labelling = open_labelling("snap")
    page = labelling.page
    method, status = page.locator("#method"), page.locator("#snap-status")
    expect(method).to_have_value("default")
    take_picture(page, "method-choice")
    method.select_option("paper")
    expect(status).to_contain_text("by the paper’s filter now")
    page.keyboard.press("Space")
    expect(status).to_have_text("The paper’s filter runs…")
    labelling.wait_for_progress()
    page.keyboard.press("Escape")
    expect(status).to_contain_text("cancelled")
    page.keyboard.press("Space")
    expect(status).to_contain_text("Snapped by the paper’s filter, confidence", timeout=90_000)
    take_picture(page, "method-paper")
    assert [e["detail"]["config"]["method"] for e in labelling.events("snap_requested", 2)] == [
        "particle_filter"
    ] * 2

    page.reload()
    expect(method).to_have_value("paper")
    labelling.submit()  # the paper's filter may end anywhere
    page.locator("#replay").click()
    applied = page.locator("#events li").filter(has_text="Snap applied")
    expect(applied).to_contain_text("paper’s filter")
    take_picture(page, "method-replay")


@pytest.mark.parametrize("condition", ["paper snap", "live snap", "manual"])
def test_where_the_condition_fixes_the_method_there_is_no_choice(
    server: Server, open_page: Callable[[str], Page], condition: Condition
) -> None:
    labelling = LabellingPage(
        open_page(server.new_link(f"fixed {condition}", "admin")), server, "box", condition
    )
    expect(labelling.page.locator("#undo")).to_be_visible()
    expect(labelling.page.locator("#method")).to_be_hidden()
    if condition == "paper snap":
        take_picture(labelling.page, "method-fixed")


def test_a_lead_sets_the_method_of_new_tasks(server: Server, open_page: Callable[[str], Page]) -> None:
    page = open_page(server.new_link("a lead of methods", "admin"))
    page.locator("#open-add-tasks").click()
    page.locator("#add-method").select_option("paper")
    page.locator("#add-objects input").first.check()
    cards = page.locator(".card").filter(has_text="paper’s filter")
    before = cards.count()
    take_picture(page, "method-add-tasks")
    page.locator("#add-start").click()
    expect(cards).to_have_count(before + 1)
    take_picture(page, "method-card")
    cards.last.click()
    expect(page.locator("#method")).to_have_value("paper")
