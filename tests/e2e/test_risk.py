"""The risk of a dataset: a lead sees what it asks for, and sets it."""

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from app.config import RISK
from registration_core import acceptance
from tests.e2e.conftest import take_picture
from tests.processes import Server

pytestmark = pytest.mark.e2e


def test_a_lead_sees_what_a_risk_asks_for_and_sets_it(
    server: Server, open_page: Callable[[str], Page]
) -> None:
    page = open_page(server.new_link("lead of the risk", "reviewer"))
    opener = page.get_by_role("button", name="Risk of demo: ")
    expect(opener).to_have_text("risk 5 %")
    datasets = page.request.get(f"{server.url}/api/datasets").json()["items"]
    url = f"{server.url}/api/datasets/{next(one['id'] for one in datasets if one['name'] == 'demo')}"
    opener.click()
    dialog = page.get_by_role("dialog", name="Risk of demo")
    expect(dialog.get_by_label("as the settings say (5 %)")).to_be_checked()
    expect(dialog).to_contain_text("only where at most 5 % of such poses are wrong")
    expect(dialog).to_contain_text(f"a confidence of {acceptance(RISK):.2f}")
    expect(dialog).to_contain_text("the calibration that comes with Snap6D")
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        take_picture(page, f"home-risk-{scheme}")

    dialog.get_by_label("1 %", exact=True).check()
    expect(dialog).to_contain_text("No confidence is known to bear 1 % out")
    expect(dialog).to_contain_text("Allow more, or calibrate it by this dataset’s own work, 230 submitted")
    expect(dialog.locator("code")).to_have_text("snap6d calibrate demo")
    take_picture(page, "home-risk-none")
    dialog.get_by_label("other").check()
    percent = dialog.locator("#risk-percent")
    percent.fill("120")
    dialog.get_by_role("button", name="Set").click()
    expect(dialog.get_by_role("alert")).to_contain_text("Give a number of percent from 0.01 to 99.")
    expect(dialog.locator("#risk-found")).to_be_hidden()
    take_picture(page, "home-risk-refused")
    assert not page.request.get(url).json()["risk_is_set"]
    percent.fill("7.5")
    expect(dialog).to_contain_text("at most 7.5 % of such poses")
    percent.press("Enter")
    expect(page.locator("#message")).to_contain_text("Risk of demo: 7.5 %.")
    expect(opener).to_have_text("risk 7.5 %")
    assert page.request.get(url).json()["risk"] == pytest.approx(0.075)

    opener.click()
    expect(dialog.get_by_label("other")).to_be_checked()
    expect(percent).to_have_value("7.5")
    dialog.get_by_label("as the settings say (5 %)").check()
    dialog.get_by_role("button", name="Set").click()
    expect(opener).to_have_text("risk 5 %")
    assert not page.request.get(url).json()["risk_is_set"]


def test_operators_have_no_say_in_it(server: Server, open_page: Callable[[str], Page]) -> None:
    page = open_page(server.new_link("no lead of the risk"))
    expect(page.get_by_role("link", name="Objects of demo")).to_be_visible()
    expect(page.get_by_role("button", name="Risk of demo: ")).to_be_hidden()
