"""A study in the browser: set up by an administrator, done by a participant from the link to the thanks."""

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import take_picture
from tests.e2e.gizmo import Handle, pull, take_hold, view_frame
from tests.e2e.labelling_page import scale_of_gizmo
from tests.processes import Server

pytestmark = pytest.mark.e2e

CONSENT = "You place objects in scenes, for about ten minutes."
QUESTION = "Have you used a 3-D program before?"
CLOCK = re.compile(r"^\d+:\d\d$")


def choose_things(page: Page) -> None:
    """One thing in each of two scenes counts, and one is for practice."""
    for index, use in enumerate(("counts", "counts", "for practice")):
        scene = page.locator(".thing").filter(has_text=f"scene {index + 1}").first
        scene.locator("select").select_option(use)


def set_up(page: Page, server: Server, name: str) -> str:
    """A study by hand alone in both modes, set up in the page; the link of its only participant."""
    page.goto(f"{server.url}/")
    page.get_by_role("link", name="Studies").click()
    page.get_by_role("link", name="New study").click()
    page.get_by_label("Name", exact=True).fill(name)
    page.get_by_label("Groups, and how many").fill("novice 1")
    page.get_by_label("Tasks between two breaks").fill("2")
    page.get_by_label("Consent").fill(CONSENT)
    page.get_by_label("Questions, one a line").fill(f"{QUESTION}: yes, no\nYears of it")
    choose_things(page)
    orders = page.locator("#preview-orders tbody tr")
    expect(orders).to_have_count(5)
    take_picture(page, "study-set-up")
    page.get_by_role("button", name="Set up the study").click()
    expect(page.get_by_role("heading", name=name)).to_be_visible()
    page.get_by_role("button", name="Invite: novice (0 of 1)").click()
    expect(page.get_by_role("button", name="Invite: novice (1 of 1)")).to_be_disabled()
    take_picture(page, "study-invited")
    return page.locator("#link-list code").inner_text()


def do_task(page: Page, first_picture: str | None = None) -> str:
    """Move the object, submit it, and tell in which mode that was."""
    frame = view_frame(page)
    expect(page.locator("#submit")).to_be_enabled()
    mode = page.locator("#trial").get_attribute("data-mode")
    if mode == "quick":
        expect(page.locator("#clock-text")).to_have_text(CLOCK)
    else:
        expect(page.locator("#clock")).to_be_hidden()
    for tool in (
        "snap",
        "place",
        "three-points",
        "find",
        "copy",
        "precision",
        "skip",
        "agreement",
        "confidence",
    ):
        expect(page.locator(f"#{tool}")).to_be_hidden()
    pull(page, *take_hold(page, frame, Handle("tx", scale_of_gizmo(page)), 0.01))
    page.mouse.up()
    expect(page.locator("#undo")).to_be_enabled()
    if first_picture:
        take_picture(page, first_picture)
    here = page.url
    page.keyboard.press("Enter")
    expect(page).not_to_have_url(here)
    return str(mode)


def test_takes_part_as_a_participant_from_link_to_thanks_on_two_scenes(
    server: Server, open_page: Callable[[str], Page]
) -> None:
    admin = open_page(server.new_link("study-chief", "admin"))
    expect(admin.locator("#account")).to_be_visible()
    link = set_up(admin, server, "Hands alone")

    page = open_page(link)
    expect(page.get_by_text(CONSENT)).to_be_visible()
    take_picture(page, "study-consent")
    page.get_by_label("I have read this and agree").check()
    page.get_by_role("button", name="Agree and go on").click()
    page.get_by_label("no", exact=True).check()
    page.get_by_label("Years of it").fill("none")
    take_picture(page, "study-questions")
    page.get_by_role("button", name="Go on").click()
    expect(page.get_by_role("heading", name="First, practise")).to_be_visible()
    page.get_by_role("button", name="Go on").click()
    take_picture(page, "study-instructions")
    page.get_by_role("button", name="Understood").click()
    expect(page.get_by_text("Practice", exact=True)).to_be_visible()
    do_task(page, "study-practice")

    page.get_by_role("button", name="Understood").click()
    modes = [do_task(page, "study-task")]
    expect(page.get_by_text("Task 2 of 4")).to_be_visible()  # straight to the next task

    page.get_by_role("link", name="Stop for now").click()  # and on again, by the same link
    page.goto("about:blank")
    page.goto(link)
    expect(page.get_by_text("1 of 4 tasks done")).to_be_visible()
    page.get_by_role("link", name="Start").click()
    modes.append(do_task(page))

    expect(page.get_by_role("heading", name="Time for a break")).to_be_visible()
    take_picture(page, "study-break")
    page.get_by_role("button", name="Go on").click()
    page.get_by_role("button", name="Understood").click()
    modes += [do_task(page), do_task(page)]
    expect(page.get_by_role("heading", name="Thank you!")).to_be_visible()
    take_picture(page, "study-thanks")
    assert modes in (["quick"] * 2 + ["accurate"] * 2, ["accurate"] * 2 + ["quick"] * 2)

    admin.reload()
    expect(admin.get_by_role("row", name="P01")).to_contain_text("4 of 4")
    expect(admin.get_by_role("row", name="P01")).to_contain_text("finished")
    take_picture(admin, "study-progress")


def test_a_participant_withdraws_and_the_administrator_erases(
    server: Server, open_page: Callable[[str], Page]
) -> None:
    admin = open_page(server.new_link("erasing-chief", "admin"))
    expect(admin.locator("#account")).to_be_visible()
    link = set_up(admin, server, "Withdrawn")
    page = open_page(link)
    page.get_by_role("button", name="Withdraw from the study").click()
    page.get_by_role("button", name="Stay").click()
    page.get_by_role("button", name="Withdraw from the study").click()
    page.get_by_role("button", name="Withdraw", exact=True).click()
    expect(page.get_by_role("heading", name="You have withdrawn")).to_be_visible()
    page.goto("about:blank")
    page.goto(link)
    expect(page.get_by_text("this link is not valid")).to_be_visible()
    take_picture(page, "study-link-void")

    admin.reload()
    row = admin.get_by_role("row", name="P01")
    expect(row).to_contain_text("withdrawn")
    row.get_by_role("button", name="Erase").click()
    take_picture(admin, "study-erase")
    admin.get_by_role("dialog").get_by_role("button", name="Erase").click()
    expect(row).to_contain_text("erased")
