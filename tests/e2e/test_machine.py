"""The machine as a partner: it takes over in `auto`, shows a ghost while live, and stays away in `manual`."""

from collections.abc import Iterator

import numpy as np
import pytest
from playwright.sync_api import expect
from sqlalchemy import select

from app.config import Settings
from app.storage.database import Database
from app.storage.tables import CalibrationRow, Dataset
from registration_core import ALGORITHM
from registration_core.geometry import pose
from tests.e2e.conftest import take_picture
from tests.e2e.demo_truth import true_pose
from tests.e2e.gizmo import wait_for_picture
from tests.e2e.labelling_page import GHOST_HIDDEN, GHOST_SHOWN, LabellingPage, OpenLabelling, hold
from tests.processes import Server

pytestmark = pytest.mark.e2e


GIZMO_NEAR = """T => {
  const {x, y, z} = window.__viserMutable.nodeRefFromName["/object"].position;
  return Math.hypot(x - T[0][3], y - T[1][3], z - T[2][3]) < 0.1;
}"""
"""Whether the gizmo is where an object at this pose has it, whose origin is not far."""


@pytest.fixture(autouse=True)
def calibrated(server: Server) -> Iterator[None]:
    """150 registrations have taught that the machine is right from a confidence of 0.5 on."""
    database = Database(Settings(state_dir=server.state_dir).resolved_database_url)
    taught = CalibrationRow(
        algorithm=ALGORITHM,
        stretch=1.0,
        shift=0.0,
        confidences=[*np.linspace(0.1, 0.49, 50), *np.linspace(0.5, 0.99, 150)],
        right=[False] * 50 + [True] * 150,
        gains={},
    )
    with database.write() as session:
        dataset_id = session.scalars(select(Dataset.id)).first()
        assert dataset_id is not None
        taught.dataset_id = dataset_id
        session.add(taught)
    yield
    with database.write() as session:
        session.delete(session.get_one(CalibrationRow, taught.id))
    database.close()


def kinds(labelling: LabellingPage) -> list[str]:
    items = labelling.page.request.get(f"{labelling.url}/events?limit=500").json()["items"]
    return [event["kind"] for event in items if event["kind"] != "view"]


def test_auto_takes_over_after_a_drag_and_undo_takes_it_back(open_labelling: OpenLabelling) -> None:
    labelling = open_labelling("auto")
    page = labelling.page
    drag = labelling.drag("tx", 0.01)
    (applied,) = labelling.events("snap_applied")
    assert applied["actor"] == "machine"
    assessment = applied["detail"]["assessment"]
    assert assessment["verdict"] == "accept"
    assert applied["detail"]["confidence"] == assessment["confidence"] >= assessment["threshold"]
    (requested,) = labelling.events("snap_requested")
    assert requested["actor"] == "machine"
    truth = true_pose(labelling.task["object"]["obj_id"])
    assert pose.distance(labelling.pose, truth).translation < 0.003
    said = f"The machine took over, confidence {applied['detail']['confidence']:.2f}."
    expect(page.locator("#note")).to_contain_text(said)
    expect(page.locator("#note-undo")).to_have_text("Undo Ctrl Z")
    expect(page.locator("#note-assessment")).to_contain_text("accept: at most 5 % of poses that are as sure")
    expect(page.locator("#assessment")).to_contain_text("accept: at most 5 %")
    take_picture(page, "label-taken-over")
    page.keyboard.press("Control+z")
    labelling.events("undo")
    assert np.allclose(labelling.pose, drag["T_after"])
    expect(page.locator("#note")).to_be_hidden()


def test_what_was_taken_back_in_auto_is_only_suggested(open_labelling: OpenLabelling) -> None:
    labelling = open_labelling("auto")
    page = labelling.page
    labelling.drag("tx", 0.01)
    labelling.events("snap_applied")
    expect(page.locator("#note")).to_contain_text("took over")
    wait_for_picture(labelling.frame)
    drag = labelling.drag("ty", 0.01)
    labelling.events("snap_offered")
    assert np.allclose(labelling.pose, drag["T_after"])
    expect(page.locator("#note")).to_contain_text("The machine suggests the ghost")
    expect(page.locator("#offer")).to_be_hidden()
    labelling.frame.wait_for_function(GHOST_SHOWN)
    expect(page.locator("#note-assessment")).to_contain_text("accept")
    take_picture(page, "label-suggested")
    page.locator("#note-accept").click()
    (accepted,) = labelling.events("accept")
    assert np.allclose(labelling.pose, accepted["T_after"])
    labelling.frame.wait_for_function(GHOST_HIDDEN)


def test_the_live_ghost_appears_in_a_drag_and_is_accepted_by_a_key(open_labelling: OpenLabelling) -> None:
    labelling = open_labelling("snap")
    page = labelling.page
    page.keyboard.press("v")
    expect(page.locator("#live")).to_have_attribute("aria-pressed", "true")
    labelling.frame.wait_for_function(GHOST_SHOWN)
    hold(labelling, "tx", 0.02)
    assert labelling.state["dragging"]
    held = labelling.pose
    expect(page.locator("#note")).to_contain_text("A snap would land at the ghost")
    take_picture(page, "label-live")
    page.mouse.up()
    labelling.events("drag")
    page.keyboard.press("y")
    (accepted,) = labelling.events("accept")
    truth = true_pose(labelling.task["object"]["obj_id"])
    assert pose.distance(labelling.pose, truth).translation < 0.003 < pose.distance(held, truth).translation
    snap = page.request.get(f"{labelling.root}/api/snaps/{accepted['snap_id']}").json()
    assert snap["state"] == "done"
    assert np.allclose(snap["estimate"]["T_world_object"], accepted["T_after"])
    labelling.frame.wait_for_function(GHOST_HIDDEN)
    assert "snap_requested" not in kinds(labelling)
    page.reload()
    expect(page.locator("#live")).to_have_attribute("aria-pressed", "true")
    page.keyboard.press("v")
    expect(page.locator("#live")).to_have_attribute("aria-pressed", "false")
    assert [event["detail"]["on"] for event in labelling.events("live")] == [True, False]


def test_the_ghost_is_accepted_with_the_object_still_in_the_hand(open_labelling: OpenLabelling) -> None:
    labelling = open_labelling("snap")
    page = labelling.page
    page.locator("#live").click()
    hold(labelling, "ty", 0.02)
    expect(page.locator("#note")).to_contain_text("A snap would land at the ghost")
    page.keyboard.press("y")
    (accepted,) = labelling.events("accept")
    page.mouse.move(600, 300)
    page.mouse.up()
    labelling.frame.wait_for_function(GIZMO_NEAR, arg=accepted["T_after"])
    assert np.allclose(labelling.pose, accepted["T_after"])
    assert kinds(labelling)[-2:] == ["drag", "accept"]


def test_manual_shows_no_machine(open_labelling: OpenLabelling) -> None:
    labelling = open_labelling("manual")
    page = labelling.page
    for hidden in ("#snap", "#cancel", "#live", "#confidence", "#note", "#offer"):
        expect(page.locator(hidden)).to_be_hidden()
    page.keyboard.press("Space")
    page.keyboard.press("v")
    labelling.drag("tx", 0.01)
    assert not {"snap_requested", "live"} & set(kinds(labelling))
    refused = page.request.post(f"{labelling.url}/snaps", data={})
    assert refused.status == 409 and "done by hand alone" in refused.json()["detail"]
    take_picture(page, "label-manual")
    page.keyboard.press("?")
    expect(page.locator("#key-list")).to_contain_text("Undo")
    expect(page.get_by_text("Snap", exact=True)).to_be_hidden()


def test_a_pose_to_look_at_says_why_in_words(open_labelling: OpenLabelling) -> None:
    labelling = open_labelling("snap")
    page = labelling.page
    risk = f"{labelling.root}/api/datasets/{labelling.task['dataset']['id']}/risk"
    assert page.request.put(risk, data={"risk": 0.0001}).ok  # which 200 registrations cannot bear out
    page.keyboard.press("Space")
    labelling.events("snap_applied")
    assessment = labelling.state["assessment"]
    assert page.request.put(risk, data={"risk": None}).ok
    assert assessment["verdict"] == "look"
    assert assessment["reasons"] == ["no confidence is known from which on at most 0.01 % are wrong"]
    shown = page.locator("#assessment")
    expect(shown).to_have_text(f"{assessment['verdict']}: {'; '.join(assessment['reasons'])}")
    expect(shown.locator(".icon")).to_be_visible()
    take_picture(page, "label-look")
    page.request.post(f"{labelling.url}/submit")
    page.goto(f"{labelling.root}/replay/{labelling.state['id']}")
    applied = page.locator("#events button").filter(has_text="Snap applied")
    expect(applied).to_contain_text(assessment["verdict"])
    applied.click()
    expect(page.locator("#ghost-assessment")).to_contain_text(assessment["reasons"][0])
    expect(page.locator("#source")).to_contain_text(
        f"posed by the machine, {assessment['confidence']:.2f}, look"
    )
    take_picture(page, "replay-look")
    page.goto(f"{labelling.root}/?state=submitted")
    expect(page.locator("#datasets")).to_contain_text("calibrated from 200 registrations")
    verdict = page.locator(f"li:has([data-task-id='{labelling.task['id']}']) .card-links .assessment")
    expect(verdict).to_have_text("the machine’s last estimate: look")
    expect(verdict).to_have_attribute("title", f"look: {'; '.join(assessment['reasons'])}")
    verdict.scroll_into_view_if_needed()
    take_picture(page, "home-calibrated")
    page.emulate_media(color_scheme="dark")
    take_picture(page, "home-calibrated-dark")
