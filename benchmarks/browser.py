"""The labelling page in a real browser: how soon and how often the outline on the image follows a drag.

The drags come over a connection of their own. Without a graphics card software draws the page and its
3-D view, which is coarse then, as the page itself chooses. What a graphics card would leave to do is measured
with that view empty.
"""

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from playwright.async_api import Page, async_playwright

from app.resources import DEMO_SCENES
from benchmarks.figures import Figure, Target, percentile
from benchmarks.operators import Operator, signed_in_operators
from benchmarks.scenes import KnownTask, known_tasks
from benchmarks.server import RunningServer, server_on
from benchmarks.viser_client import ViewClient
from registration_core.geometry import pose
from tests.e2e.conftest import CHROMIUM, CHROMIUM_ARGUMENTS, SHOWN_AROUND

Array = NDArray[np.float64]

TITLE = "The outline on the image in a real browser, in drags of a demo object, 640x480, one operator"
END_TARGET = Target(0.100)
RATE_TARGET = Target(10.0, at_least=True)
EMPTY_VIEW = "<html></html>"
SHIFT, UPDATES = 0.06, 40
"""Metres that a drag moves the object, and poses on its way: two seconds of them."""
WATCH = """if (window === top) {
  window.drawn = [];
  const original = WebGL2RenderingContext.prototype.drawArrays;
  WebGL2RenderingContext.prototype.drawArrays = function (...rest) {
    if (this.canvas.id === "outline") window.drawn.push(performance.timeOrigin + performance.now());
    return original.apply(this, rest);
  };
}"""
"""Notes when the outline is drawn, milliseconds since the epoch."""
AT_REST = """() => document.querySelector("#saved").dataset.saved === "true" && window.drawn.length &&
  performance.timeOrigin + performance.now() - window.drawn.at(-1) > 500"""
"""The drag was saved, and the outline has not been drawn for half a second."""


@dataclass
class Watched:
    """What the page showed of drags."""

    seconds_to_end: list[float] = field(default_factory=list)
    """From the last pose of a drag, with which it was let go, to the last time that the outline was drawn."""
    rates: list[float] = field(default_factory=list)
    """How often a second it was drawn while the object was held."""


def run(folder: Path, quick: bool) -> list[Figure]:
    """The first demo object is dragged there and back before an open page."""
    with server_on(folder, [DEMO_SCENES]) as server:
        return measure(server, quick)


def measure(server: RunningServer, quick: bool) -> list[Figure]:
    """One object, first with the 3-D view left empty."""
    return asyncio.run(_measure(server, known_tasks(server.state_dir)[0], 1 if quick else 30))


def _figures(watched: Watched, view: str) -> list[Figure]:
    to_end = watched.seconds_to_end
    return [
        Figure(
            f"{view}: a drag's end to the outline redrawn, median", percentile(to_end, 50), "s", END_TARGET
        ),
        Figure(f"the same, p95 of {len(to_end)}", percentile(to_end, 95), "s"),
        Figure(
            "drawings of the outline, in the drag with the fewest",
            min(watched.rates),
            "a second",
            RATE_TARGET,
        ),
    ]


async def _measure(server: RunningServer, task: KnownTask, drags: int) -> list[Figure]:
    figures = []
    async with signed_in_operators(server, 1) as (operator,):
        registration_id = await operator.start(task.id)
        await operator.set_pose(registration_id, task.T_world_object)
        for is_empty, view in ((True, "3-D view left empty"), (False, "3-D view drawn as well")):
            async with _labelling_page(server, operator, task, is_empty) as page:
                figures += _figures(await _watch(page, operator, registration_id, drags), view)
    return figures


async def _watch(page: Page, operator: Operator, registration_id: int, drags: int) -> Watched:
    watched = Watched()
    async with operator.view(registration_id) as view:
        T_gizmo = await _drag(page, view, view.T_world_gizmo, -SHIFT, Watched())  # whatever comes up by then
        for number in range(drags):
            T_gizmo = await _drag(page, view, T_gizmo, -SHIFT if number % 2 else SHIFT, watched)
    return watched


async def _drag(page: Page, view: ViewClient, T_gizmo: Array, shift: float, watched: Watched) -> Array:
    """Drag along x and note what the page showed of it; where the gizmo is then."""
    await page.wait_for_function(AT_REST)
    waves = np.sin(np.linspace(0.0, np.pi / 2, UPDATES + 1))[1:]
    path = [T_gizmo @ pose.exp(shift * wave * np.eye(6)[0]) for wave in waves]
    await page.evaluate("() => { window.drawn = []; }")
    epoch = time.time() - time.perf_counter()
    sent = np.array(await view.drag(path)) + epoch
    await page.wait_for_function(AT_REST)
    drawn = np.array(await page.evaluate("window.drawn")) / 1000
    watched.seconds_to_end.append(drawn[-1] - sent[-1])
    held = (drawn > sent[0]) & (drawn < sent[-1])
    watched.rates.append(held.sum() / (sent[-1] - sent[0]))
    return path[-1]


@asynccontextmanager
async def _labelling_page(
    server: RunningServer, operator: Operator, task: KnownTask, is_empty: bool
) -> AsyncIterator[Page]:
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=CHROMIUM, args=CHROMIUM_ARGUMENTS)
        context = await browser.new_context(viewport={"width": 1366, "height": 768}, reduced_motion="reduce")
        await context.add_cookies(
            [{"name": name, "value": value, "url": server.url} for name, value in operator.cookies]
        )
        await context.add_init_script(SHOWN_AROUND)
        await context.add_init_script(WATCH)
        page = await context.new_page()
        if is_empty:
            await page.route(
                "**/view/**", lambda route: route.fulfill(content_type="text/html", body=EMPTY_VIEW)
            )
        await page.goto(f"{server.url}/label/{task.id}")
        await page.wait_for_function("() => window.drawn.length")
        if not is_empty:
            await page.frame_locator("#view").locator("canvas").first.wait_for()
        yield page
        await browser.close()
