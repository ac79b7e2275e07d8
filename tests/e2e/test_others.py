"""Two operators before one task, each in a browser of their own: both see that, and the home page says so."""

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import take_picture
from tests.e2e.labelling_page import LabellingPage
from tests.e2e.participants import participant_link
from tests.processes import Server

pytestmark = pytest.mark.e2e


def test_operators_see_who_else_has_their_task_open(server: Server, open_page: Callable[[str], Page]) -> None:
    ada, ben = (open_page(server.new_link(name)) for name in ("Ada beside Ben", "Ben beside Ada"))
    labelling = LabellingPage(ada, server, "mug")
    expect(ada.locator("#others")).to_be_empty()

    home = open_page(server.new_link("somebody at home"))
    card = home.locator(f"[data-task-id='{labelling.task['id']}'] .card-state")
    expect(card).to_contain_text("Ada beside Ben (open now)")
    take_picture(home, "home-open-now")

    LabellingPage(ben, server, "mug")
    expect(ben.locator("#others")).to_have_text("Ada beside Ben is working on this task, too")
    expect(ada.locator("#others")).to_have_text("Ben beside Ada is working on this task, too")
    for scheme in ("light", "dark"):
        ada.emulate_media(color_scheme=scheme)
        take_picture(ada, f"label-others-{scheme}")
    third = open_page(server.new_link("x-" * 45))
    LabellingPage(third, server, "mug")
    expect(third.locator("#others")).to_have_text(
        "Ada beside Ben and Ben beside Ada are working on this task, too"
    )
    expect(ada.locator("#others")).to_contain_text("are working on this task, too")
    assert ada.evaluate("document.querySelector('.top').scrollWidth <= innerWidth")
    take_picture(ada, "label-others-of-long-names")
    third.goto("about:blank")
    expect(ada.locator("#others")).to_have_text("Ben beside Ada is working on this task, too")
    ben.goto(server.url)
    expect(ada.locator("#others")).to_be_empty()
    expect(ben.locator(f"[data-task-id='{labelling.task['id']}']")).to_contain_text(
        "Ada beside Ben (open now), you"
    )


def test_who_takes_part_in_a_study_sees_nobody_and_is_seen_by_nobody(
    server: Server, open_page: Callable[[str], Page]
) -> None:
    admin = open_page(server.new_link("who asks for a study", "admin"))
    admin.wait_for_url(f"{server.url}/")
    link = participant_link(admin, server)
    participant = open_page(link)
    participant.get_by_role("button", name="Understood").click()
    expect(participant.locator("#submit")).to_be_enabled()
    admin.goto(participant.url)
    expect(admin.locator("#submit")).to_be_enabled()
    name = participant.request.get(f"{server.url}/api/me").json()["name"]
    for page in (admin, participant):
        expect(page.locator("#others")).to_be_empty()
    assert name not in admin.locator("body").inner_text()
