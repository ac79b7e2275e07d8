"""The labelling page in a real browser: how soon and how often the outline on the image follows a drag.

The browser renders in software here where there is no GPU, so the 3-D view takes a core by itself.
"""

from dataclasses import dataclass, field
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

from benchmarks.figures import Figure, Target, percentile
from benchmarks.server import DEMO_SCENES, RunningServer, prepare_state, running_server, sign_in_secrets
from tests.e2e.conftest import CHROMIUM, CHROMIUM_ARGUMENTS, SHOWN_AROUND
from tests.e2e.gizmo import Handle, pull, take_hold, view_frame, wait_for_picture

TITLE = "The outline on the image in a real browser, drags of the first demo object, 640x480, one operator"
END_TARGET = Target(0.100)
RATE_TARGET = Target(10.0, at_least=True)
WAY, MOVES = 0.05, 60
"""Metres of a drag, and movements of the mouse on its way."""
WATCH = """{
  const now = () => performance.timeOrigin + performance.now();
  if (window === top) {
    window.drawn = [];
    const original = WebGL2RenderingContext.prototype.drawArrays;
    WebGL2RenderingContext.prototype.drawArrays = function (...rest) {
      if (this.canvas.id === "outline") window.drawn.push(now());
      return original.apply(this, rest);
    };
  } else {
    window.addEventListener("pointerdown", () => (top.taken = now()), { capture: true });
    window.addEventListener("pointerup", () => (top.letGo = now()), { capture: true });
  }
}"""
"""Milliseconds at which the outline was drawn, and at which the mouse took hold and let go."""
AT_REST = """() => document.querySelector("#saved").dataset.saved === "true" && window.letGo &&
  performance.timeOrigin + performance.now() - Math.max(window.letGo, window.drawn.at(-1)) > 500"""
"""A drag was saved, and the outline has not been drawn for half a second."""


@dataclass
class Watched:
    """What the page showed of drags."""

    seconds_to_end: list[float] = field(default_factory=list)
    """From letting go to the last time that the outline was drawn; 0 where that was before."""
    rates: list[float] = field(default_factory=list)
    """How often a second it was drawn while the object was held."""


def run(folder: Path, quick: bool) -> list[Figure]:
    """Drag the object of the first task there and back by an arrow, with the mouse."""
    state = folder / "state"
    prepare_state(state, [DEMO_SCENES])
    with running_server(state) as server, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=CHROMIUM_ARGUMENTS)
        context = browser.new_context(viewport={"width": 1366, "height": 768}, reduced_motion="reduce")
        context.add_init_script(SHOWN_AROUND)
        context.add_init_script(WATCH)
        watched = _drags(context.new_page(), server, 1 if quick else 20)
        browser.close()
    return [
        Figure(
            "from letting go to the outline's last drawing, median",
            percentile(watched.seconds_to_end, 50),
            "s",
        ),
        Figure(
            f"the same, p95 of {len(watched.seconds_to_end)}",
            percentile(watched.seconds_to_end, 95),
            "s",
            END_TARGET,
        ),
        Figure(
            "drawings of the outline in a drag, median",
            percentile(watched.rates, 50),
            "a second",
            RATE_TARGET,
        ),
        Figure("in the drag with the fewest", min(watched.rates), "a second"),
    ]


def _drags(page: Page, server: RunningServer, count: int) -> Watched:
    (secret,) = sign_in_secrets(server.state_dir, 1)
    page.goto(f"{server.url}/sign-in#{secret}")
    page.wait_for_url(f"{server.url}/")
    task = page.request.get(f"{server.url}/api/tasks/next").json()
    diameter = page.request.get(f"{server.url}/api/objects/{task['object']['id']}").json()["diameter"]
    page.goto(f"{server.url}/label/{task['id']}")
    frame = view_frame(page)
    watched = Watched()
    for number in range(count):
        page.evaluate("() => { window.drawn = []; window.letGo = 0; }")
        handle = Handle("tz", 0.75 * diameter)
        pull(page, *take_hold(page, frame, handle, -WAY if number % 2 else WAY), MOVES)
        page.mouse.up()
        page.wait_for_function(AT_REST)
        taken, let_go, drawn = page.evaluate("() => [window.taken, window.letGo, window.drawn]")
        watched.seconds_to_end.append(max(0.0, drawn[-1] - let_go) / 1000)
        watched.rates.append(sum(taken < at < let_go for at in drawn) / (let_go - taken) * 1000)
        wait_for_picture(frame)
    return watched
