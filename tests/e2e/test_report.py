"""The report of a study, put into the database from logs made by hand, read and used in a browser."""

from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from app.config import Settings
from app.storage.database import Database
from tests.app.analysis.hand_made import Entry, at, moved, view
from tests.app.analysis.hand_made_study import HandMadeStudy, ordinary_work, snapped
from tests.e2e.conftest import take_picture
from tests.e2e.page_rules import BROKEN_WORDS
from tests.e2e.study_logs import log_of
from tests.processes import Server

pytestmark = pytest.mark.e2e


PANELS = """() => {
  const root = document.documentElement;
  const panels = [...document.querySelectorAll(".chart")];
  const boxes = panels.map(panel => panel.getBoundingClientRect());
  const isCut = (text, panel) => {
    const [inner, outer] = [text, panel].map(node => node.getBoundingClientRect());
    return inner.left < outer.left || inner.right > outer.right || inner.bottom > outer.bottom;
  };
  return {
    wider: root.scrollWidth > root.clientWidth,
    lefts: boxes.map(({ left }) => Math.round(left)),
    tops: boxes.map(({ top }) => Math.round(top)),
    widths: boxes.map(({ width }) => Math.round(width)),
    cut: panels.flatMap(panel => {
      return [...panel.querySelectorAll("svg text, h2")].filter(text => isCut(text, panel));
    }).map(text => text.textContent),
  };
}"""


@pytest.fixture(scope="module")
def study(server: Server) -> int:
    """Four novices and four experts, quick and accurate, with snaps; the novices search, too."""
    database = Database(Settings(state_dir=server.state_dir).resolved_database_url)
    rng = np.random.default_rng(4)
    made = HandMadeStudy(database, "mugs by hand", groups={"novice": 4, "expert": 4, "child": 2})
    for group, pace in (("novice", 4.0), ("expert", 2.0)):
        for number in range(4):
            participant = made.participant(f"{group[0].upper()}{number + 1}", group, is_simulated=number == 3)
            for mode, hurry in (("accurate", 1.0), ("quick", 0.5)):
                rate = pace * hurry * rng.uniform(0.8, 1.2)
                entries = log_of(rate, 0.001 * rng.uniform(-1, 1) if mode == "accurate" else 0.004)
                registration = made.trial(participant, entries, mode=mode)
                assert registration is not None
                samples = [*np.arange(1.0, entries[-1].seconds, 1.0), entries[-1].seconds]
                snaps = {
                    float(t): at(0.0015 + 0.03 / t**2, rng.uniform(0.01, 0.02 + 0.4 / t)) for t in samples
                }
                made.snaps(registration, snaps)
                few = [*samples[:-1:3], samples[-1]]
                by_paper = {float(t): at(0.004 + 0.04 / t**2, 0.05 + 0.5 / t) for t in few}
                made.snaps(registration, by_paper, method="paper")
            if group == "novice":
                made.trial(participant, log_of(0.5, 0.002), mode="quick", condition="find it")
    late = [*log_of(1.0, 0.0)[:-1], moved(9.0, "submit", at(0.0), late=99.0)]
    made.trial(made.participant("L1", "novice"), late)
    database.close()
    return made.id


@pytest.fixture
def page(server: Server, study: int, open_page: Callable[[str], Page]) -> Page:
    """A reviewer looks at it."""
    page = open_page(
        server.new_link(f"reviewer of report {np.random.default_rng().integers(1 << 40)}", "reviewer")
    )
    page.wait_for_url(f"{server.url}/")
    page.goto(f"{server.url}/report/{study}")
    expect(page.locator("h1")).to_have_text("mugs by hand")
    expect(page.locator(".chart")).to_have_count(4)
    return page


def test_curves_are_chosen_read_and_lead_to_the_replay(page: Page) -> None:
    expect(page.locator("#simulated")).to_be_visible()
    expect(page.locator("#about")).to_contain_text("21 trials")
    expect(page.locator("#sections")).to_contain_text("the clock was put forward by 99 s")
    expect(page.locator("#sections")).to_contain_text("group child: has no operators")
    expect(page.locator("#legend")).to_contain_text("STG, paper’s filter, accurate")
    expect(page.locator("#sections")).to_contain_text("from the same poses, by the paper's filter")
    take_picture(page, "report")
    page.locator("#sections").scroll_into_view_if_needed()
    page.set_viewport_size({"width": 1920, "height": 1080})
    page.emulate_media(color_scheme="dark")
    take_picture(page, "report-dark-large")
    page.locator("#sections section").first.evaluate("node => node.scrollIntoView()")
    take_picture(page, "report-sections-dark")

    page.locator("select[name=group]").select_option("expert")
    page.locator("select[name=error]").select_option("rotation")
    page.locator("select[name=mode]").select_option("quick")
    expect(page.locator("#about")).to_have_text("4 trials · expert: 4 operators")
    expect(page.locator(".chart h2")).to_have_text("expert, rotation · simulated")
    assert "group=expert" in page.url and "error=rotation" in page.url

    picture = page.locator(".chart svg")
    box = picture.bounding_box()
    assert box is not None
    picture.hover(position={"x": 0.7 * box["width"], "y": 0.3 * box["height"]})
    readout = page.locator(".readout")
    expect(readout).to_contain_text("n = 4 operators, 4 trials")
    take_picture(page, "report-hover-dark")

    picture.focus()
    page.keyboard.press("ArrowLeft")
    expect(readout).to_contain_text("human, quick: within")
    page.keyboard.press("ArrowDown")
    expect(readout).to_contain_text("STG, quick: within")
    page.keyboard.press("Enter")
    page.wait_for_url("**/replay/*")
    expect(page.locator("#events")).to_contain_text("Submitted")


def test_groups_and_errors_stand_two_by_two_on_one_scale_each(page: Page) -> None:
    for width, columns in ((1366, 2), (1920, 2), (390, 1)):
        page.set_viewport_size({"width": width, "height": 768})
        found = page.evaluate(PANELS)
        assert found["wider"] is False and found["cut"] == [], width
        assert len(set(found["lefts"])) == columns and len(set(found["widths"])) == 1, width
        tops = found["tops"]
        assert tops == sorted(tops) and len(set(tops)) == 4 // columns, width
    novice, _, expert, _ = page.locator(".chart").all()
    ticks = [panel.locator(".tick").all_text_contents() for panel in (novice, expert)]
    assert ticks[0] == ticks[1]  # though novices take twice as long
    page.set_viewport_size({"width": 1366, "height": 768})
    page.locator("#panels").evaluate("node => node.scrollIntoView()")
    take_picture(page, "report-two-by-two")


def test_a_fit_and_a_point_that_tell_little_say_so_beside_their_numbers(page: Page) -> None:
    for title, words in (
        ("Fitts' law", "This fit tells little: 5 trials of 5 operators"),
        ("Hand-off", "This point tells little: "),
    ):
        part = page.locator("#sections section").filter(has=page.get_by_role("heading", name=title))
        expect(part.locator(".caution").first).to_contain_text(words)
        part.evaluate("node => node.scrollIntoView()")
        for width in (390, 1366):
            page.set_viewport_size({"width": width, "height": 768})
            assert page.evaluate(BROKEN_WORDS) == []
            take_picture(page, f"report-caution-{title[:5].lower()}-{width}")


def test_the_numbers_are_there_as_a_table_and_as_files(page: Page) -> None:
    table = page.locator("section", has_text="The curves as a table")
    table.get_by_text("Show the table").click()
    assert table.locator("tbody tr").count() == 8 * 3 * 41
    pairs = page.locator("section", has_text="Conditions in pairs").locator("tbody tr")
    expect(pairs).to_have_count(2)  # of novices, and of everybody
    expect(pairs.first).to_contain_text("novicequickfind it − manual44")
    pairs.first.scroll_into_view_if_needed()
    take_picture(page, "report-pairs")
    with page.expect_download() as download:
        page.get_by_role("link", name="Figure (PDF)").click()
    assert download.value.suggested_filename.endswith("figure.pdf")
    with page.expect_download() as download:
        page.get_by_role("link", name="Report (HTML)").click()
    assert "find it − manual" in download.value.path().read_text()  # though the page shows `manual`


def test_the_team_s_page_tells_of_ordinary_work(page: Page, server: Server) -> None:
    database = Database(Settings(state_dir=server.state_dir).resolved_database_url)
    for instance in range(70, 76):
        asked = [
            (
                Entry(4.0 + 3 * i, "snap_requested", snap_id=f"{instance} {i}"),
                snapped(5.0 + 3 * i, f"{instance} {i}", at(0.01 * i)),
            )
            for i in (1, 0)
        ]
        moves = [Entry(0.0, "opened"), view(1.0, 0.0), moved(2.0, "set_pose", at(0.06, 0.3))]
        entries = [*moves, *asked[1], *asked[0], moved(12.0, "submit", at(0.01))]
        ordinary_work(database, f"operator {instance % 2 + 1} of the team", entries, instance)
    database.close()
    page.goto(f"{server.url}/report/team")
    expect(page.locator("h1")).to_have_text("The team's work")
    expect(page.locator("#sections")).to_contain_text("Too few snaps for an advice: 6 of at least 10")
    page.locator("select[name=operator]").select_option("operator 1 of the team")
    expect(page.locator(".chart")).to_have_count(2)
    take_picture(page, "report-team")
