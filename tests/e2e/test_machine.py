"""The machine as a partner: it takes over in `auto`, shows a ghost while live, and stays away in `manual`."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from playwright.sync_api import Page, expect
from sqlalchemy import select

from app.config import Settings
from app.storage.database import Database
from app.storage.tables import CalibrationRow, Condition, Dataset
from registration_core import ALGORITHM
from registration_core.geometry import pose
from tests.e2e.conftest import take_picture
from tests.e2e.gizmo import pull, wait_for_picture
from tests.e2e.test_labelling import Desk
from tests.e2e.test_readme import true_pose
from tests.processes import Server

pytestmark = pytest.mark.e2e

OBJECT = "box"
"""Of which the machine is sure."""
GHOST_AT = """() => {
  const node = window.__viserMutable.nodeRefFromName["/ghost"];
  if (!node) return null;
  for (let above = node; above; above = above.parent) if (!above.visible) return null;
  return node.position.toArray();
}"""
GHOST_SHOWN = f"() => ({GHOST_AT})() !== null"
GHOST_HIDDEN = f"() => ({GHOST_AT})() === null"

GIZMO_NEAR = """T => {
  const {x, y, z} = window.__viserMutable.nodeRefFromName["/object"].position;
  return Math.hypot(x - T[0][3], y - T[1][3], z - T[2][3]) < 0.1;
}"""
"""Whether the gizmo is where an object at this pose has it, whose origin is not far."""

Open = Callable[[Condition], Desk]


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
        taught.dataset_id = session.scalars(select(Dataset.id)).first()
        session.add(taught)
    yield
    with database.write() as session:
        session.delete(session.get_one(CalibrationRow, taught.id))
    database.close()


@pytest.fixture
def open_desk(server: Server, open_page: Callable[[str], Page], request: pytest.FixtureRequest) -> Open:
    """Opens a new task under a condition, with the object roughly where it belongs."""

    def open_one(condition: Condition) -> Desk:
        name = request.node.name.replace("_", "-")[:60]
        desk = Desk(open_page(server.new_link(name, "admin")), server, OBJECT, condition)
        truth = true_pose(desk.task["object"]["obj_id"])
        roughly = pose.perturbed(truth, 0.01, np.radians(8), np.random.default_rng(1))
        put = desk.page.request.put(f"{desk.url}/pose", data={"T_world_object": roughly.tolist()})
        assert put.ok
        expect(desk.page.locator("#undo")).to_be_enabled()
        wait_for_picture(desk.frame)
        return desk

    return open_one


def kinds(desk: Desk) -> list[str]:
    items = desk.page.request.get(f"{desk.url}/events?limit=500").json()["items"]
    return [event["kind"] for event in items if event["kind"] != "view"]


def hold(desk: Desk, handle: str, amount: float) -> None:
    """Drag a handle with the mouse and keep hold of it."""
    pull(desk.page, *desk.take_hold(handle, amount))


def test_auto_takes_over_after_a_drag_and_undo_takes_it_back(open_desk: Open) -> None:
    desk = open_desk("auto")
    page = desk.page
    drag = desk.drag("tx", 0.01)
    (applied,) = desk.events("snap_applied")
    assert applied["actor"] == "machine"
    assessment = applied["detail"]["assessment"]
    assert assessment["verdict"] == "accept"
    assert applied["detail"]["confidence"] == assessment["confidence"] >= assessment["threshold"]
    (requested,) = desk.events("snap_requested")
    assert requested["actor"] == "machine"
    truth = true_pose(desk.task["object"]["obj_id"])
    assert pose.distance(desk.pose, truth).translation < 0.003
    said = f"The machine took over, confidence {applied['detail']['confidence']:.2f}."
    expect(page.locator("#note")).to_contain_text(said)
    expect(page.locator("#note-undo")).to_have_text("Undo Ctrl Z")
    expect(page.locator("#note-assessment")).to_contain_text("accept: at most 5 % of poses that are as sure")
    expect(page.locator("#assessment")).to_contain_text("accept: at most 5 %")
    take_picture(page, "label-taken-over")
    page.keyboard.press("Control+z")
    desk.events("undo")
    assert np.allclose(desk.pose, drag["T_after"])
    expect(page.locator("#note")).to_be_hidden()


def test_what_was_taken_back_in_auto_is_only_suggested(open_desk: Open) -> None:
    desk = open_desk("auto")
    page = desk.page
    desk.drag("tx", 0.01)
    desk.events("snap_applied")
    expect(page.locator("#note")).to_contain_text("took over")
    wait_for_picture(desk.frame)
    drag = desk.drag("ty", 0.01)
    desk.events("snap_offered")
    assert np.allclose(desk.pose, drag["T_after"])
    expect(page.locator("#note")).to_contain_text("The machine suggests the ghost")
    expect(page.locator("#offer")).to_be_hidden()
    desk.frame.wait_for_function(GHOST_SHOWN)
    expect(page.locator("#note-assessment")).to_contain_text("accept")
    take_picture(page, "label-suggested")
    page.locator("#note-accept").click()
    (accepted,) = desk.events("accept")
    assert np.allclose(desk.pose, accepted["T_after"])
    desk.frame.wait_for_function(GHOST_HIDDEN)


def test_the_live_ghost_appears_in_a_drag_and_is_accepted_by_a_key(open_desk: Open) -> None:
    desk = open_desk("snap")
    page = desk.page
    page.keyboard.press("v")
    expect(page.locator("#live")).to_have_attribute("aria-pressed", "true")
    desk.frame.wait_for_function(GHOST_SHOWN)
    hold(desk, "tx", 0.02)
    assert desk.state["dragging"]
    held = desk.pose
    expect(page.locator("#note")).to_contain_text("A snap would land at the ghost")
    take_picture(page, "label-live")
    page.mouse.up()
    desk.events("drag")
    page.keyboard.press("y")
    (accepted,) = desk.events("accept")
    truth = true_pose(desk.task["object"]["obj_id"])
    assert pose.distance(desk.pose, truth).translation < 0.003 < pose.distance(held, truth).translation
    snap = page.request.get(f"{desk.root}/api/snaps/{accepted['snap_id']}").json()
    assert snap["state"] == "done"
    assert np.allclose(snap["estimate"]["T_world_object"], accepted["T_after"])
    desk.frame.wait_for_function(GHOST_HIDDEN)
    assert "snap_requested" not in kinds(desk)
    page.reload()
    expect(page.locator("#live")).to_have_attribute("aria-pressed", "true")
    page.keyboard.press("v")
    expect(page.locator("#live")).to_have_attribute("aria-pressed", "false")
    assert [event["detail"]["on"] for event in desk.events("live")] == [True, False]


def test_the_ghost_is_accepted_with_the_object_still_in_the_hand(open_desk: Open) -> None:
    desk = open_desk("snap")
    page = desk.page
    page.locator("#live").click()
    hold(desk, "ty", 0.02)
    expect(page.locator("#note")).to_contain_text("A snap would land at the ghost")
    page.keyboard.press("y")
    (accepted,) = desk.events("accept")
    page.mouse.move(600, 300)
    page.mouse.up()
    desk.frame.wait_for_function(GIZMO_NEAR, arg=accepted["T_after"])
    assert np.allclose(desk.pose, accepted["T_after"])
    assert kinds(desk)[-2:] == ["drag", "accept"]


def test_manual_shows_no_machine(open_desk: Open) -> None:
    desk = open_desk("manual")
    page = desk.page
    for hidden in ("#snap", "#cancel", "#live", "#confidence", "#note", "#offer"):
        expect(page.locator(hidden)).to_be_hidden()
    page.keyboard.press("Space")
    page.keyboard.press("v")
    desk.drag("tx", 0.01)
    assert not {"snap_requested", "live"} & set(kinds(desk))
    refused = page.request.post(f"{desk.url}/snaps", data={})
    assert refused.status == 409 and "done by hand alone" in refused.json()["detail"]
    take_picture(page, "label-manual")
    page.keyboard.press("?")
    expect(page.locator("#key-list")).to_contain_text("Undo")
    expect(page.get_by_text("Snap", exact=True)).to_be_hidden()


def test_a_pose_to_look_at_says_why_in_words(open_desk: Open) -> None:
    desk = open_desk("snap")
    page = desk.page
    risk = f"{desk.root}/api/datasets/{desk.task['dataset']['id']}/risk"
    assert page.request.put(risk, data={"risk": 0.0001}).ok  # which 200 registrations cannot bear out
    page.keyboard.press("Space")
    desk.events("snap_applied")
    assessment = desk.state["assessment"]
    assert page.request.put(risk, data={"risk": None}).ok
    assert assessment["verdict"] == "look"
    assert assessment["reasons"] == ["no confidence is known from which on at most 0.01 % are wrong"]
    shown = page.locator("#assessment")
    expect(shown).to_have_text(f"{assessment['verdict']}: {'; '.join(assessment['reasons'])}")
    expect(shown.locator(".icon")).to_be_visible()
    take_picture(page, "label-look")
    page.request.post(f"{desk.url}/submit")
    page.goto(f"{desk.root}/replay/{desk.state['id']}")
    applied = page.locator("#events button").filter(has_text="Snap applied")
    expect(applied).to_contain_text(assessment["verdict"])
    applied.click()
    expect(page.locator("#ghost-assessment")).to_contain_text(assessment["reasons"][0])
    expect(page.locator("#source")).to_contain_text(
        f"posed by the machine, {assessment['confidence']:.2f}, look"
    )
    take_picture(page, "replay-look")
    page.goto(f"{desk.root}/?state=submitted")
    expect(page.locator("#datasets")).to_contain_text("calibrated from 200 registrations")
    verdict = page.locator(f"li:has([data-task-id='{desk.task['id']}']) .card-links .assessment")
    expect(verdict).to_have_text("the machine’s last estimate: look")
    expect(verdict).to_have_attribute("title", f"look: {'; '.join(assessment['reasons'])}")
    verdict.scroll_into_view_if_needed()
    take_picture(page, "home-calibrated")
    page.emulate_media(color_scheme="dark")
    take_picture(page, "home-calibrated-dark")
