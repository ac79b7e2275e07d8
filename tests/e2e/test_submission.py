"""Submitting: a pose that looks unfinished is asked about first; a key struck by mistake ends no trial."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from registration_core.geometry import pose
from tests.e2e.conftest import take_picture
from tests.e2e.demo_truth import true_pose
from tests.e2e.gizmo import view_frame
from tests.e2e.labelling_page import LabellingPage
from tests.e2e.participants import participant_link
from tests.processes import Server

pytestmark = pytest.mark.e2e

SLOWEST = 60_000


def test_an_untouched_start_pose_is_asked_about(server: Server, open_page: Callable[[str], Page]) -> None:
    labelling = LabellingPage(open_page(server.new_link("hasty")), server)
    page = labelling.page
    expect(page.locator("#submit")).to_be_enabled()
    page.keyboard.press("Enter")
    question = page.locator("#unsure")
    expect(question).to_contain_text("The object is still where it began.")
    expect(page.locator("#submit")).to_be_hidden()
    take_picture(page, "label-unsure")
    page.emulate_media(color_scheme="dark")
    take_picture(page, "label-unsure-dark")
    page.keyboard.press("Escape")
    expect(question).to_be_hidden()
    expect(page.locator("#submit")).to_be_visible()
    assert labelling.state["state"] == "open"

    page.locator("#submit").dblclick()  # the second click is no answer
    page.keyboard.press("Escape")
    assert labelling.state["state"] == "open"
    page.keyboard.press("Enter")
    expect(question).to_be_visible()
    page.keyboard.press("Enter")
    labelling.events("submit")
    expect(question).to_be_hidden()
    expect(page.locator("#submitted")).to_be_visible()
    assert page.request.post(f"{labelling.url}/reopen").ok  # snaps of other tests would take it for true


def test_a_pose_that_hardly_agrees_with_depth_is_asked_about(
    server: Server, open_page: Callable[[str], Page]
) -> None:
    labelling = LabellingPage(open_page(server.new_link("careless")), server, "mug")
    page, question = labelling.page, labelling.page.locator("#unsure")
    truth = true_pose(labelling.task["object"]["obj_id"])
    off = pose.perturbed(truth, 0.03, np.radians(20), np.random.default_rng(1))
    share = page.locator("#agreement-share")
    for T_world_object, agreeing in ((truth, re.compile(r"^(9\d|100) %")), (off, re.compile(r"^[1-4]?\d %"))):
        assert page.request.put(f"{labelling.url}/pose", data={"T_world_object": T_world_object.tolist()}).ok
        expect(share).to_have_text(agreeing)
    page.keyboard.press("Enter")
    expect(question).to_contain_text("of the depth agrees; a right pose has 94 % or more")
    take_picture(page, "label-unsure-off")
    page.keyboard.press("Control+z")
    expect(question).to_be_hidden()  # it was about another pose
    labelling.events("undo")
    page.keyboard.press("Enter")
    labelling.events("submit")
    expect(question).to_be_hidden()


def test_a_trial_is_not_ended_by_a_key_before_the_first_move(
    server: Server, open_page: Callable[[str], Page]
) -> None:
    admin = open_page(server.new_link("hasty chief", "admin"))
    expect(admin.locator("#account")).to_be_visible()
    page = open_page(participant_link(admin, server))
    page.get_by_role("button", name="Understood").click()
    view_frame(page)
    expect(page.locator("#submit")).to_be_enabled(timeout=SLOWEST)
    here, question = page.url, page.locator("#unsure")
    page.keyboard.press("Enter")
    expect(question).to_contain_text("a trial cannot be taken back")
    take_picture(page, "study-unsure")
    page.keyboard.press("Escape")
    expect(question).to_be_hidden()
    assert page.url == here
    page.keyboard.press("Enter")
    expect(question).to_be_visible()
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", name="Thank you!")).to_be_visible()


def test_the_next_task_follows_the_filter_of_the_home_page(
    server: Server, open_page: Callable[[str], Page]
) -> None:
    page = open_page(server.new_link("follower"))
    page.wait_for_url(f"{server.url}/")
    query = "?dataset_id=1&scene_id=3&state=open"
    page.goto(f"{server.url}/{query}")
    page.locator("[data-task-id]").first.click()
    page.wait_for_url(f"{server.url}/label/*{query}")
    view_frame(page)
    expect(page.locator("#submit")).to_be_enabled(timeout=SLOWEST)
    page.keyboard.press("Shift+Enter")
    page.keyboard.press("4")
    following = page.locator("#next-task")
    expect(following).to_contain_text("Next task")
    expect(page.locator("#next-name")).to_contain_text("scene 3")
    wanted = following.get_attribute("href")
    assert wanted is not None and wanted.endswith(query)
    page.keyboard.press("Enter")
    page.wait_for_url(f"{server.url}{wanted}")
