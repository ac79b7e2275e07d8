"""What axe finds on the pages, in light and in dark: nothing."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page, expect

from app.config import Settings
from app.storage.database import Database
from tests.app.analysis.hand_made import at
from tests.app.analysis.hand_made_study import HandMadeStudy
from tests.e2e.gizmo import view_frame
from tests.e2e.labelling_page import LabellingPage
from tests.e2e.participants import participant_link
from tests.e2e.study_logs import log_of
from tests.processes import Server

pytestmark = pytest.mark.e2e

OPTIONS = {"resultTypes": ["violations"], "iframes": False}
"""The only iframes are the 3-D views. What is in them is viser's: a canvas, and panels that the page puts
away."""
OF_COLOURS = {"type": "rule", "values": ["color-contrast", "link-in-text-block"]}
"""What another colour scheme can break."""


def faults(page: Page, options: dict[str, object] = OPTIONS) -> list[str]:
    """What axe finds wrong on the page as it is, an element a line."""
    found = Axe().run(page, options=options).response["violations"]
    return [
        f"{rule['id']}: {node['html']} {node['failureSummary']}" for rule in found for node in rule["nodes"]
    ]


def expect_accessible(page: Page) -> None:
    """Axe finds nothing, in light and in dark."""
    page.emulate_media(color_scheme="light")
    assert not (found := faults(page)), "\n".join(found)
    page.emulate_media(color_scheme="dark")
    in_dark = faults(page, OPTIONS | {"runOnly": OF_COLOURS})
    assert not in_dark, "\n".join(["in the dark scheme:", *in_dark])


@pytest.fixture
def admin(server: Server, open_page: Callable[[str], Page], request: pytest.FixtureRequest) -> Page:
    """Somebody who may see every page, on the home page."""
    page = open_page(server.new_link(re.sub(r"\W", "-", request.node.name)[:60], "admin"))
    page.wait_for_url(f"{server.url}/")
    expect(page.locator("main")).not_to_have_attribute("aria-busy", "true")
    return page


@pytest.fixture
def labelling(
    server: Server, open_page: Callable[[str], Page], request: pytest.FixtureRequest
) -> LabellingPage:
    """A new operator before a task."""
    return LabellingPage(open_page(server.new_link(re.sub(r"\W", "-", request.node.name)[:60])), server)


def test_axe_finds_a_fault_where_there_is_one(admin: Page) -> None:
    admin.evaluate("document.querySelector('main').append(document.createElement('button'))")
    assert [fault.split(":")[0] for fault in faults(admin)] == ["button-name"]


@pytest.mark.parametrize(
    "path", ["/", "/report/team", "/studies", "/studies?new", "/export", "/objects/1", "/nothing"]
)
def test_of_a_page(admin: Page, server: Server, path: str) -> None:
    admin.goto(server.url + path)
    expect(admin.locator("main")).not_to_have_attribute("aria-busy", "true")
    admin.wait_for_load_state("networkidle")
    expect_accessible(admin)


@pytest.mark.parametrize("name", ["import", "risk", "add-tasks"])
def test_of_a_dialog_of_the_home_page(admin: Page, name: str) -> None:
    opener = {"risk": admin.get_by_role("button", name=re.compile("^Risk")).first}
    opener.get(name, admin.locator(f"#open-{name}")).click()
    expect(admin.locator(f"#{name}")).to_be_visible()
    admin.wait_for_load_state("networkidle")
    expect_accessible(admin)


def test_of_the_sign_in_page(server: Server, open_page: Callable[[str], Page]) -> None:
    page = open_page(f"{server.url}/sign-in")
    page.get_by_role("button", name="Sign in").click()
    expect_accessible(page)


def test_of_a_labelling_page(labelling: LabellingPage) -> None:
    page = labelling.page
    page.locator("#precision summary").click()
    expect_accessible(page)
    page.keyboard.press("Space")
    labelling.events("snap_applied")
    expect(page.locator("#confidence-number")).not_to_have_text("–")
    expect_accessible(page)
    labelling.submit()
    expect(page.locator("#next-task")).to_be_visible()
    expect_accessible(page)
    assert page.request.post(f"{labelling.url}/reopen").ok  # snaps of other tests would pass it by


def test_of_what_opens_on_a_labelling_page(labelling: LabellingPage) -> None:
    page = labelling.page
    page.route("**/copies", lambda route: route.fulfill(json={"items": []}))
    page.keyboard.press("c")
    expect(page.locator("#copies-none")).to_be_visible()
    expect_accessible(page)
    page.keyboard.press("Escape")
    expect(page.locator("#copies-none")).to_be_hidden()
    page.locator("#skip").click()
    expect(page.locator("#skip-dialog")).to_be_visible()
    expect_accessible(page)
    page.keyboard.press("Escape")
    expect(page.locator("#skip-dialog")).to_be_hidden()
    page.locator("#help").click()
    expect(page.locator("#keys")).to_be_visible()
    expect_accessible(page)
    page.get_by_role("button", name="Show me around").click()
    expect(page.locator("#guide")).to_be_visible()
    expect_accessible(page)


def test_of_copies(server: Server, open_page: Callable[[str], Page]) -> None:
    first = LabellingPage(open_page(server.new_link("one-to-copy-from")), server, "mug")
    first.submit()
    page = LabellingPage(open_page(server.new_link("one-who-copies")), server, "mug").page
    page.keyboard.press("c")
    expect(page.locator("#copy-list")).to_contain_text("one-to-copy-from")
    expect_accessible(page)
    assert first.page.request.post(f"{first.url}/reopen").ok


def test_of_a_tab_that_another_took_over(labelling: LabellingPage) -> None:
    newer = labelling.page.context.new_page()
    newer.goto(labelling.page_url)
    expect(labelling.page.locator("#closed")).to_contain_text("opened in another tab")
    expect_accessible(labelling.page)


def test_of_a_replay(labelling: LabellingPage) -> None:
    page = labelling.page
    labelling.drag("tx", 0.02)
    labelling.submit()
    page.locator("#replay").click()
    page.wait_for_url("**/replay/*")
    view_frame(page)
    expect(page.locator("#events")).to_contain_text("Submitted")
    expect_accessible(page)
    assert page.request.post(f"{labelling.url}/reopen").ok


def test_of_a_study_and_its_participants(
    admin: Page, server: Server, open_page: Callable[[str], Page]
) -> None:
    link = participant_link(admin, server)
    page = open_page(link)
    expect(page.get_by_role("button", name="Understood")).to_be_visible()
    expect_accessible(page)
    page.get_by_role("button", name="Understood").click()
    view_frame(page)
    expect(page.locator("#trial-place")).to_have_text("Task 1 of 1")
    expect_accessible(page)
    admin.goto(f"{server.url}/studies")
    admin.get_by_role("link", name="Trouble").first.click()
    expect(admin.get_by_role("heading", name="Trouble")).to_be_visible()
    admin.wait_for_load_state("networkidle")
    expect_accessible(admin)


@pytest.fixture(scope="module")
def study(server: Server) -> int:
    """One with everything in its report: two novices by hand and with snaps, in both modes."""
    database = Database(Settings(state_dir=server.state_dir).resolved_database_url)
    made = HandMadeStudy(database, "mugs for axe", groups={"novice": 2})
    for number in (1, 2):
        participant = made.participant(f"N{number}", "novice", is_simulated=number == 2)
        for mode in ("accurate", "quick"):
            registration = made.trial(participant, log_of(number, 0.001), mode=mode)
            assert registration is not None
            made.snaps(registration, {float(t): at(0.001, 0.01) for t in range(1, 6)})
    database.close()
    return made.id


def test_of_a_report(admin: Page, server: Server, study: int) -> None:
    admin.goto(f"{server.url}/report/{study}")
    expect(admin.locator(".chart").first).to_be_visible()
    admin.get_by_text("Show the table").click()
    expect_accessible(admin)


def test_of_a_report_in_one_file(admin: Page, server: Server, study: int, tmp_path: Path) -> None:
    admin.goto(f"{server.url}/report/{study}")
    with admin.expect_download() as download:
        admin.get_by_role("link", name="Report (HTML)").click()
    download.value.save_as(tmp_path / "report.html")
    for width in (1366, 390):
        admin.set_viewport_size({"width": width, "height": 768})
        admin.goto((tmp_path / "report.html").as_uri())
        expect_accessible(admin)
