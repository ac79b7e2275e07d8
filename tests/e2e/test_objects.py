"""Several objects in a scene: what is done is shown and listed; skipping, reopening, and going on."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from app.resources import DEMO_SCENES
from registration_core.bop.dataset import read_dataset
from tests.e2e.conftest import take_picture
from tests.e2e.gizmo import view_frame, wait_for_picture
from tests.e2e.labelling_page import LabellingPage
from tests.processes import Server

pytestmark = pytest.mark.e2e

HAS_NODE = "([name, wanted]) => Boolean(window.__viserMutable.nodeRefFromName[name]) === wanted"


def true_poses() -> dict[str, np.ndarray]:
    """T_world_object (4, 4) of the objects of the first demo scene, by name."""
    dataset = read_dataset(DEMO_SCENES)
    names = {known.obj_id: known.name for known in dataset.objects}
    image = dataset.scenes[0].images[0]
    assert image.T_world_camera is not None
    return {names[t.obj_id]: image.T_world_camera @ t.T_camera_object for t in image.ground_truth or ()}


def finish_another(labelling: LabellingPage, name: str, T_world_object: np.ndarray) -> tuple[int, str]:
    """Submit another object of the scene as the same operator: (task, the registration's address)."""
    request = labelling.page.request
    tasks = request.get(f"{labelling.root}/api/tasks?scene_id=1").json()["items"]
    task_id = next(task["id"] for task in tasks if task["object"]["name"] == name)
    started = request.post(f"{labelling.root}/api/tasks/{task_id}/registration").json()
    url = f"{labelling.root}/api/registrations/{started['id']}"
    assert request.put(f"{url}/pose", data={"T_world_object": T_world_object.tolist()}).ok
    assert request.post(f"{url}/submit").ok
    return task_id, url


def test_what_is_done_is_shown_listed_and_hidden(server: Server, open_page: Callable[[str], Page]) -> None:
    labelling = LabellingPage(open_page(server.new_link("several")), server, "mug")
    page, poses = labelling.page, true_poses()
    others = [name for name in poses if name != labelling.task["object"]["name"]][:3]
    finished = [finish_another(labelling, name, poses[name]) for name in others]
    task_id = finished[0][0]
    page.request.post(f"{labelling.url}/skip", data={"reason": "ambiguous"})  # draws the page anew
    page.request.post(f"{labelling.url}/reopen")
    expect(page.locator("#things-done")).to_contain_text(re.compile("[3-9] of . others done"), timeout=30_000)
    page.locator("#things summary").click()
    entry = page.locator(f"#things-list a[href='/label/{task_id}']")
    expect(entry).to_contain_text("done")
    node = f"/neighbours/{task_id}"
    labelling.frame.wait_for_function(HAS_NODE, arg=[node, True], timeout=30_000)
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        wait_for_picture(labelling.frame)
        take_picture(page, f"label-objects-{scheme}")
    page.keyboard.press("Shift+B")
    labelling.frame.wait_for_function(HAS_NODE, arg=[node, False], timeout=30_000)
    expect(page.locator("#hide-things")).to_contain_text("Show done")
    page.reload()
    labelling.frame = view_frame(page)
    expect(page.locator("#hide-things")).to_contain_text("Show done", timeout=30_000)
    labelling.frame.wait_for_function(HAS_NODE, arg=[node, False], timeout=30_000)
    page.locator("#hide-things").click()
    labelling.frame.wait_for_function(HAS_NODE, arg=[node, True], timeout=30_000)
    entry.click()
    page.wait_for_url(f"**/label/{task_id}")
    expect(page.locator("#crumb-object")).to_contain_text(others[0], timeout=30_000)
    for _, url in finished:
        page.request.post(f"{url}/reopen")


def test_skip_with_a_reason_reopen_submit_and_go_on(server: Server, open_page: Callable[[str], Page]) -> None:
    labelling = LabellingPage(open_page(server.new_link("skipper")), server, "mug")
    page = labelling.page
    expect(page.locator("#skip")).to_be_enabled(timeout=30_000)
    page.keyboard.press("Shift+Enter")
    expect(page.locator("#skip-dialog")).to_be_visible()
    take_picture(page, "label-skip")
    page.keyboard.press("4")
    (skipped,) = labelling.events("skip")
    assert skipped["detail"] == {"reason": "ambiguous"}
    expect(page.locator("#submitted")).to_contain_text("Skipped: ambiguous.")
    expect(page.locator("#next-name")).to_contain_text("Next:")
    page.locator("#reopen").click()
    labelling.events("reopen")
    expect(page.locator("#submit")).to_be_enabled()
    labelling.drag("tx", 0.02)
    labelling.submit_unsure()
    expect(page.locator("#submitted")).to_contain_text("Submitted.")
    page.keyboard.press("Enter")
    page.wait_for_url(lambda url: "/label/" in url and url != labelling.page_url)
    page.request.post(f"{labelling.url}/reopen")
    page.request.post(f"{labelling.url}/skip", data={"reason": "no depth"})
    page.goto(server.url)
    card = page.locator(f"[data-task-id='{labelling.task['id']}']")
    expect(card).to_contain_text("you (no depth)")
    card.scroll_into_view_if_needed()
    take_picture(page, "home-skipped")
