"""The labelling page with mouse and keys, on a demo scene."""

import os
import re
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import take_picture
from tests.e2e.gizmo import (
    expect_new_view,
    view_frame,
)
from tests.e2e.labelling_page import SLOW_SNAP, LabellingPage
from tests.processes import Server, command_line, descendants, serving

pytestmark = pytest.mark.e2e


@pytest.fixture
def labelling(
    server: Server, open_page: Callable[[str], Page], request: pytest.FixtureRequest
) -> LabellingPage:
    """A new operator before a task that nobody has."""
    name = re.sub(r"\W", "-", request.node.name)[:60]
    return LabellingPage(open_page(server.new_link(name)), server)


def test_every_handle_is_logged_with_its_degrees_of_freedom(labelling: LabellingPage) -> None:
    size = labelling.scale
    for handle, amount, expected in [
        ("tx", 0.2 * size, {"tx"}),
        ("rz", 0.2, {"rz"}),
        ("tz", 0.2 * size, {"tz"}),
        ("rx", 0.2, {"rx"}),
        ("pxz", 0.1 * size, {"tx", "tz"}),
        ("ry", -0.2, {"ry"}),
        ("ty", -0.2 * size, {"ty"}),
    ]:
        event = labelling.drag(handle, amount)
        assert set(event["dof"]) == expected, handle
        assert event["path"][0][0] == 0.0
        assert event["duration_seconds"] > 0
    assert np.allclose(labelling.pose, event["T_after"])


def test_keys_undo_redo_reset_and_reload(labelling: LabellingPage) -> None:
    page = labelling.page
    start = labelling.pose
    labelling.drag("tx", 0.03)
    moved = labelling.pose
    page.keyboard.press("Control+z")  # the focus is in the 3-D view after a drag
    labelling.events("undo")
    assert np.allclose(labelling.pose, start)
    page.keyboard.press("Control+Shift+z")
    labelling.events("redo")
    assert np.allclose(labelling.pose, moved)
    page.locator("#reset").click()
    labelling.events("reset")
    assert np.allclose(labelling.pose, start)
    page.reload()
    view_frame(page)
    page.keyboard.press("Control+z")
    labelling.events("undo", 2)
    assert np.allclose(labelling.pose, moved)
    page.keyboard.press("?")
    expect(page.locator("dialog#keys")).to_be_visible()
    take_picture(page, "label-keys")
    page.keyboard.press("Escape")
    expect(page.locator("dialog#keys")).to_be_hidden()


def test_snap_with_space_improves_and_can_be_undone(labelling: LabellingPage, server: Server) -> None:
    page = labelling.page
    before = labelling.pose
    page.keyboard.press("Space")
    (applied,) = labelling.events("snap_applied")
    expect(page.locator("#source")).to_contain_text("machine")
    assert np.allclose(labelling.pose, applied["T_after"])
    snap = page.request.get(f"{labelling.root}/api/snaps/{applied['snap_id']}").json()
    assert snap["state"] == "done"
    assert 0 <= snap["estimate"]["confidence"] <= 1
    page.keyboard.press("Control+z")
    labelling.events("undo")
    assert np.allclose(labelling.pose, before)


def test_a_snap_can_be_cancelled(labelling: LabellingPage) -> None:
    page = labelling.page
    assert page.request.post(f"{labelling.url}/snaps", data={"config": SLOW_SNAP}).ok
    expect(page.locator("#cancel")).to_be_enabled()
    labelling.wait_for_progress()
    take_picture(page, "label-snap-running")
    page.locator("#cancel").click()
    labelling.events("snap_cancelled")
    expect(page.locator("#snap")).to_be_enabled()
    assert labelling.state["snap"]["state"] == "cancelled"


def test_a_result_is_offered_when_the_operator_moved_on(labelling: LabellingPage, server: Server) -> None:
    page = labelling.page
    with held_up(workers_of(server)):
        page.keyboard.press("Space")
        labelling.events("snap_requested")
        labelling.drag("ty", 0.02)
    labelling.events("snap_offered")
    mine = labelling.pose
    expect(page.locator("#offer")).to_be_visible()
    take_picture(page, "label-offer")
    assert np.allclose(labelling.pose, mine)
    page.keyboard.press("y")
    (accepted,) = labelling.events("accept")
    assert np.allclose(labelling.pose, accepted["T_after"])
    expect(page.locator("#offer")).to_be_hidden()


def test_a_dead_worker_is_told_and_the_next_snap_works(labelling: LabellingPage, server: Server) -> None:
    page = labelling.page
    assert page.request.post(f"{labelling.url}/snaps", data={"config": SLOW_SNAP}).ok
    labelling.wait_for_progress()
    for process in workers_of(server):
        os.kill(process, signal.SIGKILL)
    labelling.events("snap_failed")
    expect(page.locator("#message")).to_contain_text("worker died")
    take_picture(page, "label-worker-died")
    page.get_by_role("button", name="Try again").click()
    labelling.events("snap_applied")
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
        labelling = LabellingPage(open_page(server.sign_in_link), server)
        labelling.drag("tx", 0.02)
        kept = labelling.pose
        expect_new_view(labelling.frame)
        server.kill()
    expect(labelling.page.locator("#connection")).to_be_visible(timeout=20_000)
    take_picture(labelling.page, "label-connection-lost")
    with serving(server.state_dir, "--port", server.url.rsplit(":", 1)[1]):
        expect(labelling.page.locator("#connection")).to_be_hidden(timeout=30_000)
        assert np.allclose(labelling.pose, kept)
        labelling.frame = view_frame(labelling.page)
        labelling.drag("tz", 0.02)
        assert not np.allclose(labelling.pose, kept)
        labelling.page.locator("#undo").click()
        labelling.events("undo")
        assert np.allclose(labelling.pose, kept)
