"""A link pasted into a tab that shows its page already signs in, and its secret leaves the address."""

import re
from collections.abc import Callable

import httpx
from playwright.sync_api import Page, expect

from tests.app.api.study_rest import invite, new_study
from tests.app.waiting import LONGEST
from tests.e2e.conftest import take_picture
from tests.processes import Server


def administrator(server: Server) -> httpx.Client:
    client = httpx.Client(base_url=server.url.replace("localhost", "127.0.0.1"), timeout=LONGEST)
    token = server.command("token", "create", "who invites", "--role", "admin").strip()
    client.headers["authorization"] = f"Bearer {token}"
    return client


def test_a_sign_in_link_pasted_into_the_sign_in_page(
    server: Server, open_page: Callable[[str], Page]
) -> None:
    link = server.new_link("paula who pastes")
    page = open_page(f"{server.url}/sign-in?next=%2Fstudies")
    expect(page.get_by_label("Name")).to_be_visible()
    page.goto(f"{server.url}/sign-in?next=%2Fstudies#made-up")  # only the hash changes: nothing is loaded
    expect(page.get_by_text("was used before or is too old")).to_be_visible()
    assert page.evaluate("location.href") == f"{server.url}/sign-in?next=%2Fstudies"
    take_picture(page, "sign-in-pasted-link-void")
    page.goto(link.replace("/sign-in#", "/sign-in?next=%2Fstudies#"))
    expect(page).to_have_url(f"{server.url}/studies")
    page.go_back()
    expect(page).to_have_url(re.compile("^(?!.*#)"))


def test_a_participants_link_pasted_into_the_page_of_another(
    server: Server, open_page: Callable[[str], Page]
) -> None:
    with administrator(server) as client:
        study = new_study(client)
        invited = [invite(client, study, "expert") for _ in range(2)]
    links = [one["link"].replace("127.0.0.1", "localhost") for one in invited]
    page = open_page(f"{server.url}/participate")
    expect(page.get_by_text("open the link that was given to you")).to_be_visible()
    for one, link in zip(invited, links, strict=True):
        page.goto(link)
        expect(page.locator("#code")).to_have_text(one["code"])
        assert page.evaluate("location.href") == f"{server.url}/participate"
    take_picture(page, "study-pasted-link")
    page.goto(f"{server.url}/participate#made-up")
    expect(page.get_by_text("this link is not valid")).to_be_visible()
    assert page.evaluate("location.href") == f"{server.url}/participate"
