"""The labelling page with the registration behind it, as a person finds and uses it."""

import re
import time
from collections.abc import Callable

import numpy as np
from playwright.sync_api import Page, expect

from app.storage.tables import Condition
from registration_core.geometry import pose
from tests.e2e.gizmo import (
    Handle,
    place_of_object,
    pull,
    take_hold,
    view_frame,
    wait_for_object,
    wait_for_picture,
)
from tests.processes import Server

SLOW_SNAP = {"preset": "paper", "particle_filter": {"iterations": 10_000, "particles": 200}}
"""Runs for a long time in small steps."""


OPEN = ("in_progress", "open")
"""States of a task that nobody has ended. Each test has an operator of its own, who begins it anew."""


class LabellingPage:
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


OpenLabelling = Callable[[Condition], LabellingPage]
"""Opens a new task under a condition; see the fixture `open_labelling`."""


def scale_of_gizmo(page: Page) -> float:
    """Of the task that the page shows, metres."""
    root, _, task_id = page.url.rpartition("/label/")
    task = page.request.get(f"{root}/api/tasks/{task_id}").json()
    item = page.request.get(f"{root}/api/objects/{task['object']['id']}").json()
    return 0.75 * float(item["diameter"])


GHOST_AT = """() => {
  const node = window.__viserMutable.nodeRefFromName["/ghost"];
  if (!node) return null;
  for (let above = node; above; above = above.parent) if (!above.visible) return null;
  return node.position.toArray();
}"""


GHOST_SHOWN = f"() => ({GHOST_AT})() !== null"


GHOST_HIDDEN = f"() => ({GHOST_AT})() === null"


def hold(labelling: LabellingPage, handle: str, amount: float) -> None:
    """Drag a handle with the mouse and keep hold of it."""
    pull(labelling.page, *labelling.take_hold(handle, amount))
