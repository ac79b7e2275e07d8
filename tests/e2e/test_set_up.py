"""Setting a study up in the browser: objects, what it amounts to, errors at fields, optional questions."""

from collections.abc import Callable

import pytest
from playwright.sync_api import Locator, Page, Route, expect

from tests.e2e.conftest import take_picture
from tests.e2e.page_rules import BROKEN_WORDS
from tests.processes import Server

pytestmark = pytest.mark.e2e

WIDER = "document.documentElement.scrollWidth > document.documentElement.clientWidth"


@pytest.fixture
def admin(server: Server, open_page: Callable[[str], Page], request: pytest.FixtureRequest) -> Page:
    """An administrator at the set-up page."""
    page = open_page(server.new_link(f"setter-up {request.node.name}", "admin"))
    expect(page.locator("#account")).to_be_visible()
    page.goto(f"{server.url}/studies?new")
    expect(page.locator("#set-up")).to_be_visible()
    return page


def problem(page: Page, field: str) -> Locator:
    return page.locator(f"#{field}-problem")


def test_objects_are_found_and_used_all_at_once(admin: Page) -> None:
    rows = admin.locator(".thing:visible")
    expect(rows.nth(19)).to_be_visible()
    mugs, things = rows.filter(has_text="mug").count(), rows.count()
    assert 4 <= mugs < things
    admin.get_by_label("Find an object").fill("MUG")
    expect(rows).to_have_count(mugs)
    admin.get_by_label("Find a scene").fill("2")
    expect(rows).to_have_count(1)
    admin.get_by_role("button", name="Count all shown").click()
    admin.get_by_label("Find a scene").fill("")
    expect(admin.locator("#things-told")).to_have_text(
        f"{mugs} of {things} objects shown · 1 count, 0 for practice"
    )
    admin.get_by_label("Find an object").press("Enter")  # sets nothing up
    expect(problem(admin, "name")).to_be_hidden()
    admin.get_by_role("button", name="Use none shown").click()
    expect(admin.locator("#things-told")).to_contain_text("0 count")
    admin.get_by_label("Find an object").fill("zebra")
    expect(admin.get_by_text("Nothing is called so")).to_be_visible()
    expect(admin.get_by_role("button", name="Count all shown")).to_be_disabled()


def test_what_it_amounts_to_is_said_while_it_is_edited(admin: Page) -> None:
    expect(admin.locator("#preview-summary")).to_contain_text("Choose at least one object that counts")
    admin.get_by_label("Find an object").fill("mug")
    admin.get_by_role("button", name="Count all shown").click()
    amounts = admin.locator("#amounts dd")
    expect(amounts).to_have_text(["8", "12 min", "16", "3.2 h"])
    admin.get_by_label("Groups, and how many").fill("novice 3")
    admin.get_by_label("snap the handles, and Snap").check()
    admin.get_by_label("Find an object").fill("drill")
    admin.locator(".thing:visible select").first.select_option("for practice")
    expect(amounts).to_have_text(["16 + 2 practice", "26 min", "3", "78 min"])
    expect(admin.locator("#order-note")).to_contain_text(
        "a multiple of 4 participants; that is not so for novice"
    )
    for scheme in ("light", "dark"):
        admin.emulate_media(color_scheme=scheme)
        for width in (1366, 390):
            admin.set_viewport_size({"width": width, "height": 768})
            assert not admin.evaluate(WIDER), width
            take_picture(admin, f"study-set-up-{scheme}-{width}")


def test_nothing_is_shown_half_drawn_while_it_loads(admin: Page) -> None:
    held: list[Route] = []

    def hold(route: Route) -> None:
        held.append(route)

    admin.route("**/api/tasks?*", hold)
    with admin.expect_request("**/api/tasks?*"):
        admin.reload()
    expect(admin.locator(".skeleton")).to_be_visible()
    expect(admin.locator("main")).to_have_attribute("aria-busy", "true")
    expect(admin.locator("#set-up")).to_be_hidden()
    take_picture(admin, "study-set-up-loading")
    held.pop().continue_()
    expect(admin.locator(".thing").nth(19)).to_be_attached()
    expect(admin.locator(".skeleton")).to_be_hidden()
    expect(admin.locator("#set-up")).to_be_visible()


def test_errors_stand_at_their_fields_until_they_are_mended(admin: Page, server: Server) -> None:
    fields = ("name", "modes", "conditions", "groups", "break-after", "seed", "things", "questions")
    for field in fields:
        expect(problem(admin, field)).to_be_hidden()  # nobody is blamed before they have begun
    admin.get_by_label("Tasks between two breaks").fill("")
    admin.get_by_label("Groups, and how many").fill("novice 2, novice 3")
    expect(problem(admin, "groups")).to_have_text("The group “novice” is there twice: write each once.")
    admin.get_by_role("button", name="Set up the study").click()
    expect(admin.get_by_label("Name", exact=True)).to_be_focused()
    expect(admin.get_by_label("Name", exact=True)).to_have_attribute("aria-invalid", "true")
    expect(problem(admin, "name")).to_have_text("Give the study a name.")
    expect(problem(admin, "break-after")).to_contain_text("0 means no breaks")
    expect(problem(admin, "things")).to_contain_text("Choose at least one object that counts")
    expect(problem(admin, "seed")).to_be_hidden()
    take_picture(admin, "study-set-up-problems")
    admin.get_by_label("Name", exact=True).fill("Mended")
    admin.get_by_label("Tasks between two breaks").fill("0")
    admin.get_by_label("Groups, and how many").fill("novice 2")
    admin.locator(".thing select").first.select_option("counts")
    admin.get_by_label("Questions, one a line").fill("Years\nHand: left")  # which the server refuses
    expect(problem(admin, "questions")).to_contain_text("Question 2: left is the only choice")
    admin.get_by_label("Questions, one a line").fill("Years\nHand: left, right")
    expect(admin.locator("#preview-orders tbody tr")).to_have_count(2)
    for field in fields:
        expect(problem(admin, field)).to_be_hidden()
    admin.get_by_role("button", name="Set up the study").click()
    expect(admin.get_by_role("heading", name="Mended")).to_be_visible()
    admin.goto(f"{server.url}/studies?new")
    admin.get_by_label("Name", exact=True).fill("Mended")
    expect(problem(admin, "name")).to_contain_text("There already is a study “Mended”")


def test_an_answer_to_what_was_written_before_is_ignored(admin: Page) -> None:
    admin.locator(".thing select").first.select_option("counts")
    expect(admin.locator("#preview-orders tbody tr")).to_have_count(2)
    held: list[Route] = []

    def hold_the_first(route: Route) -> None:
        held.append(route)
        if len(held) > 1:
            route.continue_()

    admin.route("**/api/studies/preview", hold_the_first)
    with admin.expect_request("**/api/studies/preview"):
        admin.get_by_label("Questions, one a line").fill("Hand: left")
    with admin.expect_response(lambda answer: answer.url.endswith("/preview") and answer.ok):
        admin.get_by_label("Questions, one a line").fill("Hand: left, right")
        held[0].continue_()  # is refused, but is no longer what the form says
    expect(admin.locator("#preview")).not_to_have_attribute("aria-busy", "true")
    expect(admin.locator("#preview-orders tbody tr")).to_have_count(2)
    expect(problem(admin, "questions")).to_be_hidden()


def test_what_is_optional_is_left_empty_or_declined(
    admin: Page, server: Server, open_page: Callable[[str], Page]
) -> None:
    admin.get_by_label("Name", exact=True).fill("Asking little")
    admin.get_by_label("Groups, and how many").fill("novice 1")
    admin.locator(".thing select").first.select_option("counts")
    admin.get_by_label("Questions, one a line").fill(
        "Used a 3-D program: yes, no\nHandedness (optional): left, right\nYears of it (optional)"
    )
    expect(admin.locator("#questions-read")).to_have_text(
        "Read as 3 questions: 2 with choices, 1 free; 2 optional."
    )
    admin.get_by_role("button", name="Set up the study").click()
    admin.get_by_role("button", name="Invite: novice (0 of 1)").click()
    link = admin.locator("#link-list code").inner_text()

    page = open_page(link)
    questions = page.locator("#questions")
    expect(questions.locator("small")).to_have_text(["required", "optional", "optional"])
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        for width in (1366, 390):
            page.set_viewport_size({"width": width, "height": 768})
            assert not page.evaluate(WIDER), width
            take_picture(page, f"study-questions-optional-{scheme}-{width}")
    page.get_by_role("button", name="Go on").click()
    expect(questions).to_be_visible()  # what is required holds it
    page.get_by_label("no", exact=True).check()
    page.get_by_label("Rather not say").check()
    page.get_by_role("button", name="Go on").click()
    expect(questions).to_be_hidden()

    admin.reload()
    said = admin.get_by_role("row", name="P01").locator("dd")
    expect(said).to_have_text(["no", "Rather not say", "left empty"])
    expect(admin.get_by_role("row", name="P01")).to_contain_text("under way")
    take_picture(admin, "study-answers")
    with admin.expect_download() as download:
        admin.get_by_role("link", name="Answers (CSV)").click()
    text = download.value.path().read_text()
    assert "Handedness,Rather not say,declined" in text and "Years of it,,left empty" in text


def test_no_word_of_a_table_is_broken_on_a_narrow_screen(admin: Page, server: Server) -> None:
    admin.get_by_label("Name", exact=True).fill("Of simulated people")
    admin.get_by_label("Groups, and how many").fill("inexperienced 1")
    admin.locator(".thing select").first.select_option("counts")
    admin.get_by_role("button", name="Set up the study").click()
    admin.get_by_role("button", name="Invite: inexperienced (0 of 1)").click()
    expect(admin.get_by_role("row", name="P01")).to_be_visible()
    admin.set_viewport_size({"width": 390, "height": 768})
    assert admin.evaluate(BROKEN_WORDS) == []
    admin.goto(f"{server.url}/studies")
    expect(admin.get_by_role("link", name="Of simulated people")).to_be_visible()
    assert admin.evaluate(BROKEN_WORDS) == [] and not admin.evaluate(WIDER)
    take_picture(admin, "studies-390")
