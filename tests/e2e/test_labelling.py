"""The labelling page with mouse and keys, on a demo scene."""

import os
import re
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from app.storage.tables import Condition
from registration_core.geometry import pose
from tests.e2e.conftest import take_picture
from tests.e2e.gizmo import (
    Handle,
    expect_new_view,
    place_of_object,
    pull,
    take_hold,
    view_frame,
    wait_for_object,
    wait_for_picture,
)
from tests.processes import Server, command_line, descendants, serving

pytestmark = pytest.mark.e2e

SLOW_SNAP = {"preset": "paper", "particle_filter": {"iterations": 10_000, "particles": 200}}
"""Runs for a long time in small steps."""


OPEN = ("in_progress", "open")
"""States of a task that nobody has ended. Each test has an operator of its own, who begins it anew."""


class Desk:
    """A labelling page and the registration behind it."""

    def __init__(
        self,
        page: Page,
        server: Server,
        object_name: str = "",
        condition: Condition | None = None,
        scene_id: int = 1,
    ) -> None:
        """Open the first task that nobody has submitted, or that of an object in a demo scene.

        With a condition it is a new task under this one, which only an administrator may ask for.
        """
        self.page = page
        page.wait_for_url(f"{server.url}/")
        wanted = f"scene_id={scene_id}" if object_name else "limit=200"
        tasks = page.request.get(f"{server.url}/api/tasks?{wanted}").json()["items"]
        self.task = next(
            task
            for task in tasks
            if object_name in task["object"]["name"] and (object_name or task["state"] in OPEN)
        )
        if condition is not None:
            scene_id, object_id = self.task["scene"]["id"], self.task["object"]["id"]
            wanted_task = {"scene_id": scene_id, "object_id": object_id, "condition": condition}
            self.task = page.request.post(f"{server.url}/api/tasks", data=wanted_task).json()
        self.page_url = f"{server.url}/label/{self.task['id']}"
        page.goto(self.page_url)
        self.frame = view_frame(page)
        self.root = server.url
        started = page.request.post(f"{server.url}/api/tasks/{self.task['id']}/registration").json()
        self.url = f"{server.url}/api/registrations/{started['id']}"
        item = page.request.get(f"{server.url}/api/objects/{self.task['object']['id']}").json()
        self.scale = 0.75 * item["diameter"]
        self.pivot = pose.apply(pose.inverse(self.pose), place_of_object(self.frame))
        """Where the gizmo is on the object (3,)."""

    @property
    def state(self) -> dict:
        return self.page.request.get(self.url).json()

    @property
    def pose(self) -> np.ndarray:
        return np.array(self.state["T_world_object"])

    def events(self, kind: str, count: int = 1) -> list[dict]:
        """The events of a kind, once there are so many."""
        deadline = time.monotonic() + 90
        while time.monotonic() < deadline:
            items = self.page.request.get(f"{self.url}/events?limit=500").json()["items"]
            found = [event for event in items if event["kind"] == kind]
            if len(found) >= count:
                return found
            self.page.wait_for_timeout(50)
        seen = [(event["kind"], event["detail"]) for event in items]
        raise AssertionError(f"{kind} came {len(found)} times; there is {seen}")

    def submit_unsure(self) -> None:
        """Submit a pose that the page asks about, once it knows how little agrees."""
        expect(self.page.locator("#agreement-share")).to_have_text(re.compile(r"^([1-4]?\d %|–)"))
        self.page.keyboard.press("Enter")
        expect(self.page.locator("#unsure")).to_be_visible()
        self.page.keyboard.press("Enter")
        self.events("submit")

    def submit(self) -> None:
        """Submit whatever the pose is, and say so again where the page asks."""
        asked, submitted = self.page.locator("#unsure-submit"), self.page.locator("#replay")
        self.page.locator("#submit").click()
        expect(asked.or_(submitted).filter(visible=True)).to_have_count(1)
        if asked.is_visible():
            asked.click()
        expect(submitted).to_be_visible()

    def wait_for(self, is_so: Callable[[dict], bool]) -> None:
        """Return when something is so of the registration's state on the server."""
        deadline = time.monotonic() + 90
        while not is_so(self.state):
            assert time.monotonic() < deadline, self.state
            self.page.wait_for_timeout(50)

    def wait_for_progress(self) -> None:
        """Return when a snap is under way in a worker."""
        self.wait_for(lambda state: (state["snap"] or {"progress": 0})["progress"] > 0)

    def wait_until_shown(self) -> None:
        """Return when the 3-D view has the object where it is."""
        wait_for_object(self.frame, pose.apply(self.pose, self.pivot))

    def take_hold(self, handle: str, amount: float) -> tuple[np.ndarray, np.ndarray]:
        """Press the mouse on a handle; see `gizmo.take_hold`."""
        self.wait_until_shown()
        return take_hold(self.page, self.frame, Handle(handle, self.scale), amount)

    def drag(self, handle: str, amount: float) -> dict:
        """Drag a handle with the mouse and return the event that was logged."""
        items = self.page.request.get(f"{self.url}/events?limit=500").json()["items"]
        before = sum(event["kind"] == "drag" for event in items)
        pull(self.page, *self.take_hold(handle, amount))
        self.page.mouse.up()
        event = self.events("drag", before + 1)[-1]
        wait_for_picture(self.frame)
        return event


@pytest.fixture
def desk(server: Server, open_page: Callable[[str], Page], request: pytest.FixtureRequest) -> Desk:
    """A new operator before a task that nobody has."""
    name = re.sub(r"\W", "-", request.node.name)[:60]
    return Desk(open_page(server.new_link(name)), server)


def test_every_handle_is_logged_with_its_degrees_of_freedom(desk: Desk) -> None:
    size = desk.scale
    for handle, amount, expected in [
        ("tx", 0.2 * size, {"tx"}),
        ("rz", 0.2, {"rz"}),
        ("tz", 0.2 * size, {"tz"}),
        ("rx", 0.2, {"rx"}),
        ("pxz", 0.1 * size, {"tx", "tz"}),
        ("ry", -0.2, {"ry"}),
        ("ty", -0.2 * size, {"ty"}),
    ]:
        event = desk.drag(handle, amount)
        assert set(event["dof"]) == expected, handle
        assert event["path"][0][0] == 0.0
        assert event["duration_seconds"] > 0
    assert np.allclose(desk.pose, event["T_after"])


def test_keys_undo_redo_reset_and_reload(desk: Desk) -> None:
    page = desk.page
    start = desk.pose
    desk.drag("tx", 0.03)
    moved = desk.pose
    page.keyboard.press("Control+z")  # the focus is in the 3-D view after a drag
    desk.events("undo")
    assert np.allclose(desk.pose, start)
    page.keyboard.press("Control+Shift+z")
    desk.events("redo")
    assert np.allclose(desk.pose, moved)
    page.locator("#reset").click()
    desk.events("reset")
    assert np.allclose(desk.pose, start)
    page.reload()
    view_frame(page)
    page.keyboard.press("Control+z")
    desk.events("undo", 2)
    assert np.allclose(desk.pose, moved)
    page.keyboard.press("?")
    expect(page.locator("dialog#keys")).to_be_visible()
    take_picture(page, "label-keys")
    page.keyboard.press("Escape")
    expect(page.locator("dialog#keys")).to_be_hidden()


def test_snap_with_space_improves_and_can_be_undone(desk: Desk, server: Server) -> None:
    page = desk.page
    before = desk.pose
    page.keyboard.press("Space")
    (applied,) = desk.events("snap_applied")
    expect(page.locator("#source")).to_contain_text("machine")
    assert np.allclose(desk.pose, applied["T_after"])
    snap = page.request.get(f"{desk.root}/api/snaps/{applied['snap_id']}").json()
    assert snap["state"] == "done"
    assert 0 <= snap["estimate"]["confidence"] <= 1
    page.keyboard.press("Control+z")
    desk.events("undo")
    assert np.allclose(desk.pose, before)


def test_a_snap_can_be_cancelled(desk: Desk) -> None:
    page = desk.page
    assert page.request.post(f"{desk.url}/snaps", data={"config": SLOW_SNAP}).ok
    expect(page.locator("#cancel")).to_be_enabled()
    desk.wait_for_progress()
    take_picture(page, "label-snap-running")
    page.locator("#cancel").click()
    desk.events("snap_cancelled")
    expect(page.locator("#snap")).to_be_enabled()
    assert desk.state["snap"]["state"] == "cancelled"


def test_a_result_is_offered_when_the_operator_moved_on(desk: Desk, server: Server) -> None:
    page = desk.page
    with held_up(workers_of(server)):
        page.keyboard.press("Space")
        desk.events("snap_requested")
        desk.drag("ty", 0.02)
    desk.events("snap_offered")
    mine = desk.pose
    expect(page.locator("#offer")).to_be_visible()
    take_picture(page, "label-offer")
    assert np.allclose(desk.pose, mine)
    page.keyboard.press("y")
    (accepted,) = desk.events("accept")
    assert np.allclose(desk.pose, accepted["T_after"])
    expect(page.locator("#offer")).to_be_hidden()


def test_a_dead_worker_is_told_and_the_next_snap_works(desk: Desk, server: Server) -> None:
    page = desk.page
    assert page.request.post(f"{desk.url}/snaps", data={"config": SLOW_SNAP}).ok
    desk.wait_for_progress()
    for process in workers_of(server):
        os.kill(process, signal.SIGKILL)
    desk.events("snap_failed")
    expect(page.locator("#message")).to_contain_text("worker died")
    take_picture(page, "label-worker-died")
    page.get_by_role("button", name="Try again").click()
    desk.events("snap_applied")
    expect(page.locator("#message")).to_be_hidden()


@contextmanager
def held_up(processes: list[int]) -> Iterator[None]:
    """Let processes wait until the block ends."""
    for process in processes:
        os.kill(process, signal.SIGSTOP)
    try:
        yield
    finally:
        for process in processes:
            os.kill(process, signal.SIGCONT)


def workers_of(server: Server) -> list[int]:
    """The processes that compute snaps."""
    return [
        pid
        for pid in descendants(server.process.pid)
        if any("spawn_main" in word for word in command_line(pid))
    ]


def test_the_page_goes_on_after_the_server_was_killed(
    open_page: Callable[[str], Page], tmp_path: Path
) -> None:
    with serving(tmp_path / "state", "--prepare") as server:
        desk = Desk(open_page(server.sign_in_link), server)
        desk.drag("tx", 0.02)
        kept = desk.pose
        expect_new_view(desk.frame)
        server.kill()
    expect(desk.page.locator("#connection")).to_be_visible(timeout=20_000)
    take_picture(desk.page, "label-connection-lost")
    with serving(server.state_dir, "--port", server.url.rsplit(":", 1)[1]):
        expect(desk.page.locator("#connection")).to_be_hidden(timeout=30_000)
        assert np.allclose(desk.pose, kept)
        desk.frame = view_frame(desk.page)
        desk.drag("tz", 0.02)
        assert not np.allclose(desk.pose, kept)
        desk.page.locator("#undo").click()
        desk.events("undo")
        assert np.allclose(desk.pose, kept)
