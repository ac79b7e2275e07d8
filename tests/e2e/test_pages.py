"""What the pages share: the way to the others, no blank, names of any length, an end for wrong addresses."""

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import ConsoleMessage, Page, Route, ViewportSize, expect

from tests.conftest import REPOSITORY
from tests.e2e.conftest import take_picture
from tests.e2e.gizmo import view_frame
from tests.processes import Server, serving

pytestmark = pytest.mark.e2e

PAGES = {"Home": "/", "Team": "/report/team", "Studies": "/studies", "Export": "/export"}
WIDE: ViewportSize = {"width": 1366, "height": 768}
PHONE: ViewportSize = {"width": 390, "height": 844}
LONG = "x-" * 59
"""As long as a name may be and more than any line holds: 118 characters."""
IS_TOO_WIDE = "selector => document.querySelector(selector).scrollWidth > innerWidth"


@pytest.fixture
def admin(server: Server, open_page: Callable[[str], Page], request: pytest.FixtureRequest) -> Page:
    """Somebody who may see every page."""
    name = re.sub(r"\W", "-", request.node.name)[:60]
    page = open_page(server.new_link(name, "admin"))
    page.wait_for_url(f"{server.url}/")
    return page


def test_the_pages_share_one_navigation(admin: Page, server: Server) -> None:
    for name, path in PAGES.items():
        admin.goto(server.url + path)
        links = admin.locator("#pages a")
        expect(links).to_have_text(list(PAGES))
        assert links.evaluate_all("all => all.map(a => a.getAttribute('href'))") == list(PAGES.values())
        expect(admin.locator("#pages [aria-current=page]")).to_have_text(name)


def test_an_operator_is_shown_the_way_to_no_page_that_refuses_them(
    server: Server, open_page: Callable[[str], Page]
) -> None:
    page = open_page(server.new_link("walker"))
    expect(page.locator("#pages a")).to_have_text(["Home"])


@pytest.mark.parametrize("path", PAGES.values())
def test_no_page_is_blank_while_it_loads(admin: Page, server: Server, path: str) -> None:
    held: list[Route] = []
    is_holding = True

    def hold(route: Route) -> None:
        if is_holding:
            held.append(route)
        else:
            route.continue_()

    admin.route("**/api/**", hold)
    admin.goto(server.url + path, wait_until="commit")
    expect(admin.locator("main")).to_contain_text("Loading…")
    expect(admin.locator("main .loading")).to_be_visible()
    is_holding = False
    for route in held:
        route.continue_()
    expect(admin.locator("main .loading")).to_be_hidden()
    expect(admin.locator("#pages [aria-current=page]")).to_be_visible()


@pytest.mark.parametrize("path", ["/nothing", "/label/abc", "/label/999999"])
def test_an_address_that_leads_nowhere_leads_home(admin: Page, server: Server, path: str) -> None:
    admin.goto(server.url + path)
    expect(admin.get_by_role("heading", name="There is no such page")).to_be_visible()
    take_picture(admin, "missing")
    admin.get_by_role("link", name="Go to the home page").click()
    expect(admin.locator("#pages")).to_be_visible()
    assert admin.url == f"{server.url}/"


@pytest.mark.parametrize("path", PAGES.values())
def test_every_page_fits_a_phone(admin: Page, server: Server, path: str) -> None:
    admin.set_viewport_size(PHONE)
    admin.goto(server.url + path)
    expect(admin.locator("main .loading")).to_be_hidden()
    take_picture(admin, f"phone-{path.strip('/').replace('/', '-') or 'home'}")
    assert not admin.evaluate(IS_TOO_WIDE, "html")


def test_long_names_break_no_page(open_page: Callable[[str], Page], tmp_path: Path) -> None:
    with serving(tmp_path / "state", "--prepare") as server:
        server.command("import", str(dataset_of_long_names(tmp_path / "long")), "--name", LONG)
        page = open_page(server.new_link(LONG, "admin"))
        page.wait_for_url(f"{server.url}/")
        tasks = page.request.get(f"{server.url}/api/tasks").json()["items"]
        task = next(task for task in tasks if task["dataset"]["name"] == LONG)
        thing = {"scene_id": task["scene"]["id"], "object_id": task["object"]["id"]}
        plan = {"tasks": [thing], "groups": {"novice": 1}}
        study = page.request.post(f"{server.url}/api/studies", data={"name": LONG, "plan": plan}).json()
        assert page.request.post(f"{server.url}/api/exports", data={"dataset_id": task["dataset"]["id"]}).ok
        for path in (
            *PAGES.values(),
            "/studies?new",
            f"/studies?study={study['id']}",
            f"/report/{study['id']}",
            f"/objects/{task['object']['id']}",
            f"/label/{task['id']}",
        ):
            page.goto(server.url + path)
            expect(page.get_by_text(LONG).filter(visible=True).first).to_be_visible()
            expect(page.locator("main .loading")).to_be_hidden()
            for size in (WIDE, PHONE):
                page.set_viewport_size(size)
                name = path.strip("/").replace("/", "-").replace("?", "-") or "home"
                take_picture(page, f"long-{name}-{size['width']}")
                is_bench = path.startswith("/label/") and size is PHONE  # nobody poses objects on a phone
                assert not page.evaluate(IS_TOO_WIDE, ".top" if is_bench else "html"), (path, size)
        page.goto("about:blank")  # before the server ends


def dataset_of_long_names(folder: Path) -> Path:
    """The first demo scene, with objects of long names."""
    demo = REPOSITORY / "scenes" / "demo"
    shutil.copytree(demo / "models", folder / "models")
    shutil.copytree(demo / "test" / "000001", folder / "test" / "000001")
    shutil.copy(demo / "camera.json", folder)
    names = json.loads((folder / "models" / "names.json").read_text())
    (folder / "models" / "names.json").write_text(json.dumps(dict.fromkeys(names, LONG)))
    return folder


def test_back_leads_to_where_one_was(admin: Page, server: Server) -> None:
    expect(admin.locator("main .loading")).to_be_hidden()
    admin.locator("[data-task-id]").last.scroll_into_view_if_needed()
    top = admin.evaluate("scrollY")
    assert top > 200
    admin.goto(f"{server.url}/studies")
    admin.go_back()
    admin.wait_for_function("top => Math.abs(scrollY - top) < 2", arg=top)
    admin.goto(server.url)  # by a link one comes to its beginning
    expect(admin.locator("main .loading")).to_be_hidden()
    assert admin.evaluate("scrollY") == 0


def test_no_page_warns_in_the_console(admin: Page, server: Server) -> None:
    said: list[str] = []

    def listen(message: ConsoleMessage) -> None:
        if message.type in {"warning", "error"} and not message.text.startswith("THREE."):  # viser's
            said.append(f"{admin.url}: {message.text}")

    admin.on("console", listen)
    for path in (*PAGES.values(), "/studies?new", "/objects/1", "/sign-in"):
        admin.goto(server.url + path, wait_until="networkidle")
    admin.goto(f"{server.url}/label/1")
    view_frame(admin)
    assert said == []
