"""A real server in a process of its own, and a real browser."""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, sync_playwright

from tests.conftest import REPOSITORY

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
PICTURES = REPOSITORY / "test-results" / "screenshots"
START_SECONDS = 120


@dataclass
class Server:
    """A running `snap6d serve`."""

    process: subprocess.Popen[str]
    state_dir: Path
    url: str
    sign_in_link: str

    def stop(self) -> int:
        """Ask it to end, wait until it has, and return its exit code."""
        self.process.terminate()
        return self.wait()

    def kill(self) -> None:
        """End it at once, with everything that it started."""
        for process in descendants(self.process.pid):
            os.kill(process, signal.SIGKILL)
        self.process.kill()
        self.wait()

    def wait(self) -> int:
        """Wait until it has ended and return its exit code."""
        assert self.process.stdout is not None
        with self.process.stdout:
            return self.process.wait(30)

    def command(self, *arguments: str) -> str:
        """What a `snap6d` command on the same state prints."""
        return run_snap6d(self.state_dir, *arguments)

    def api(self, token: str) -> httpx.Client:
        """A REST client with an API token."""
        return httpx.Client(base_url=self.url, headers={"authorization": f"Bearer {token}"}, timeout=60)

    def new_link(self, name: str, role: str = "operator") -> str:
        """A one-time sign-in link of a new user."""
        printed = self.command("user", "add", name, "--role", role)
        secret = printed.strip().rsplit("#", 1)[1]
        return f"{self.url}/sign-in#{secret}"


def environment(state_dir: Path) -> dict[str, str]:
    """What a `snap6d` process is started with."""
    return {**os.environ, "SNAP6D_STATE_DIR": str(state_dir), "PYTHONUNBUFFERED": "1"}


def run_snap6d(state_dir: Path, *arguments: str) -> str:
    """Run a command to its end and return what it printed."""
    done = subprocess.run(
        [sys.executable, "-m", "app.cli", *arguments],
        env=environment(state_dir),
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def start_server(state_dir: Path, *arguments: str) -> Server:
    """Start a server on a free port and wait until it says that it is ready."""
    process = subprocess.Popen(
        [sys.executable, "-m", "app.cli", "serve", "--port", "0", *arguments],
        env=environment(state_dir),
        cwd=REPOSITORY,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout is not None
    printed = []
    for line in process.stdout:
        printed.append(line)
        if match := re.search(r"(http://\S+)/sign-in#\S+", line):
            return Server(process, state_dir, match[1], match[0])
    raise AssertionError("the server did not start:\n" + "".join(printed))


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server with the demo scenes, and with the real ones where they are at hand."""
    running = start_server(tmp_path_factory.mktemp("state"), "--prepare")
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
        page = contexts[-1].new_page()
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.goto(url)
        return page

    yield open_one
    for context in contexts:
        context.close()
    assert problems == []


@pytest.fixture(scope="session")
def admin_state(server: Server, browser: Browser) -> str:
    """Cookies of the local administrator, who signed in with the one-time link."""
    context = browser.new_context()
    page = context.new_page()
    page.goto(server.sign_in_link)
    page.wait_for_url(f"{server.url}/")
    state = PICTURES.parent / "admin-state.json"
    context.storage_state(path=state)
    context.close()
    return str(state)


def take_picture(page: Page, name: str) -> None:
    """Write what the page shows, for people to look at."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=PICTURES / f"{name}.png")


def descendants(pid: int) -> set[int]:
    """Processes that a process started, and those started in turn."""
    children: dict[int, list[int]] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                stat = (entry / "stat").read_text()
            except (FileNotFoundError, ProcessLookupError):
                continue
            parent = int(stat.rsplit(")", 1)[1].split()[1])
            children.setdefault(parent, []).append(int(entry.name))
    found: set[int] = set()
    waiting = [pid]
    while waiting:
        for child in children.get(waiting.pop(), []):
            found.add(child)
            waiting.append(child)
    return found
