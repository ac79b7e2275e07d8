"""The labelling page in a real browser: how soon and how often the outline on the image follows a drag.

The drags come over a connection of their own, and the page's 3-D view is left empty: without a GPU a browser
spends most of its time on drawing that in software. So the outline is drawn here, too, but it costs little.
"""

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from playwright.async_api import Page, async_playwright

from benchmarks.figures import Figure, Target, percentile
from benchmarks.operators import Operator, signed_in_operators
from benchmarks.scenes import KnownTask, known_tasks
from benchmarks.server import DEMO_SCENES, RunningServer, prepare_state, running_server
from registration_core import pose
from tests.e2e.conftest import CHROMIUM, CHROMIUM_ARGUMENTS, SHOWN_AROUND

TITLE = "The outline on the image in a real browser, in drags of a demo object, 640x480, one operator"
END_TARGET = Target(0.100)
RATE_TARGET = Target(10.0, at_least=True)
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
    state = folder / "state"
    prepare_state(state, [DEMO_SCENES])
    with running_server(state) as server:
        watched = asyncio.run(_measure(server, known_tasks(state)[0], 2 if quick else 30))
    to_end = watched.seconds_to_end
    return [
        Figure("from a drag's end to the outline redrawn, median", percentile(to_end, 50), "s", END_TARGET),
        Figure(f"the same, p95 of {len(to_end)}", percentile(to_end, 95), "s"),
        Figure(
            "drawings of the outline, in the drag with the fewest",
            min(watched.rates),
            "a second",
            RATE_TARGET,
        ),
    ]


async def _measure(server: RunningServer, task: KnownTask, drags: int) -> Watched:
    watched = Watched()
    async with signed_in_operators(server, 1) as (operator,), _labelling_page(server, operator, task) as page:
        registration_id = await operator.start(task.id)
        await operator.set_pose(registration_id, task.T_world_object)
        async with operator.view(registration_id) as view:
            await page.wait_for_function(AT_REST)
            T_gizmo = view.T_world_gizmo
            for number in range(drags):
                sign = 1 if number % 2 else -1
                waves = np.sin(np.linspace(0.0, np.pi / 2, UPDATES + 1))[1:]
                path = [T_gizmo @ pose.exp(sign * SHIFT * wave * np.eye(6)[0]) for wave in waves]
                await page.evaluate("() => { window.drawn = []; }")
                epoch = time.time() - time.perf_counter()
                sent = np.array(await view.drag(path)) + epoch
                await page.wait_for_function(AT_REST)
                drawn = np.array(await page.evaluate("window.drawn")) / 1000
                watched.seconds_to_end.append(drawn[-1] - sent[-1])
                held = (drawn > sent[0]) & (drawn < sent[-1])
                watched.rates.append(held.sum() / (sent[-1] - sent[0]))
                T_gizmo = path[-1]
    return watched


@asynccontextmanager
async def _labelling_page(server: RunningServer, operator: Operator, task: KnownTask) -> AsyncIterator[Page]:
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=CHROMIUM, args=CHROMIUM_ARGUMENTS)
        context = await browser.new_context(viewport={"width": 1366, "height": 768}, reduced_motion="reduce")
        await context.add_cookies(
            [{"name": name, "value": value, "url": server.url} for name, value in operator.cookies]
        )
        await context.add_init_script(SHOWN_AROUND)
        await context.add_init_script(WATCH)
        page = await context.new_page()
        await page.route(
            "**/view/**", lambda route: route.fulfill(content_type="text/html", body="<html></html>")
        )
        await page.goto(f"{server.url}/label/{task.id}")
        await page.wait_for_function("() => window.drawn.length")
        yield page
        await browser.close()
