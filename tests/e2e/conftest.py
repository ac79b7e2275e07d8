"""A real server in a process of its own, and a real browser."""

import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect, sync_playwright

from app.storage.tables import Condition
from registration_core.geometry import pose
from tests.e2e.demo_truth import true_pose
from tests.e2e.gizmo import wait_for_picture
from tests.e2e.labelling_page import LabellingPage, OpenLabelling
from tests.processes import Server, serving

CHROMIUM = os.environ.get("SNAP6D_CHROMIUM", "/usr/bin/chromium")
CHROMIUM_ARGUMENTS = [
    "--headless=new",
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
SHOWN_AROUND = """if (location.protocol !== "about:" && !localStorage["snap6d.guide.1"]) {
  for (let id = 1; id < 500; id++) localStorage[`snap6d.guide.${id}`] = '{"isOn": false}';
}"""
"""Everybody has seen the guide."""
DRAWN_FINELY = """if (location.protocol !== "about:") localStorage["snap6d.layers"] ??= '{"fine": true}'"""
"""Somebody wants all measured points, though software has to draw them."""
SURE = "box"
"""An object of the demo scenes that the machine is sure of."""
LONGEST_MS = 90_000
"""That anything may take on a machine that is busy with others."""
PICTURES = os.environ.get("SNAP6D_PICTURES")
"""The folder that screenshots are written to, for people to look at; none are taken where it is not set."""

expect.set_options(timeout=LONGEST_MS / 3)


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server with the demo scenes, and with the real ones where they are at hand."""
    with serving(tmp_path_factory.mktemp("state"), "--prepare") as running:
        yield running
        assert running.stop() in {0, -signal.SIGTERM}


@pytest.fixture(scope="session")
def ycbv(server: Server, shared_data: Path) -> Path:
    """The real YCB-Video excerpt, imported."""
    server.command("import", str(shared_data / "ycbv"))
    return shared_data / "ycbv"


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Chromium with software rendering."""
    if not Path(CHROMIUM).exists():
        pytest.fail("chromium is missing; ./scripts/test installs it")
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=CHROMIUM_ARGUMENTS)
        yield chromium
        chromium.close()


@pytest.fixture
def open_page(browser: Browser) -> Iterator[Callable[[str], Page]]:
    """Opens pages, each as another person; a script error on one fails the test."""
    contexts: list[BrowserContext] = []
    problems: list[str] = []

    def open_one(url: str) -> Page:
        contexts.append(browser.new_context(viewport={"width": 1366, "height": 768}, reduced_motion="reduce"))
        contexts[-1].add_init_script(SHOWN_AROUND)
        contexts[-1].set_default_timeout(LONGEST_MS)
        page = contexts[-1].new_page()
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.goto(url)
        return page

    yield open_one
    for context in contexts:
        context.close()
    assert problems == []


@pytest.fixture
def open_labelling(
    server: Server, open_page: Callable[[str], Page], request: pytest.FixtureRequest
) -> OpenLabelling:
    """Opens a new task of an administrator, with the object roughly where it belongs."""

    def open_one(condition: Condition) -> LabellingPage:
        name = request.node.name.replace("_", "-")[:60]
        labelling = LabellingPage(open_page(server.new_link(name, "admin")), server, SURE, condition)
        truth = true_pose(labelling.task["object"]["obj_id"])
        roughly = pose.perturbed(truth, 0.01, np.radians(8), np.random.default_rng(1))
        put = labelling.page.request.put(f"{labelling.url}/pose", data={"T_world_object": roughly.tolist()})
        assert put.ok
        expect(labelling.page.locator("#undo")).to_be_enabled()
        wait_for_picture(labelling.frame)
        return labelling

    return open_one


def drawing_finely(page: Page) -> Page:
    """The same page, whose 3-D view will show all that was measured: for pictures."""
    page.add_init_script(DRAWN_FINELY)
    return page


def take_picture(page: Page, name: str) -> None:
    """Write what the page shows, where pictures are wanted: software takes long to draw them."""
    if PICTURES:
        page.screenshot(path=Path(PICTURES) / f"{name}.png", timeout=LONGEST_MS)
