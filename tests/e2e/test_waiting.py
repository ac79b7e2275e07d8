"""Snaps that wait: no worker at all, all of them busy, and one that takes long."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from distributed import LocalCluster
from playwright.sync_api import Page, expect

from tests.e2e.conftest import take_picture
from tests.e2e.labelling_page import SLOW_SNAP, LabellingPage
from tests.processes import Server, serving

pytestmark = pytest.mark.e2e

SLOWEST = 90_000


@pytest.fixture
def cluster() -> Iterator[LocalCluster]:
    """A scheduler without workers."""
    here = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0"}
    with LocalCluster(n_workers=0, threads_per_worker=1, **here) as started:
        yield started


@pytest.fixture
def server(cluster: LocalCluster, tmp_path: Path) -> Iterator[Server]:
    with serving(
        tmp_path / "state", "--prepare", "--scheduler-address", cluster.scheduler_address
    ) as running:
        yield running


def test_it_is_told_what_a_snap_waits_for(
    server: Server, cluster: LocalCluster, open_page: Callable[[str], Page]
) -> None:
    ann = LabellingPage(open_page(server.sign_in_link), server, "mug")
    status, seconds = ann.page.locator("#snap-status"), ann.page.locator("#snap-seconds")
    ann.page.keyboard.press("Space")
    expect(status).to_contain_text("No worker is there", timeout=SLOWEST)
    expect(seconds).to_have_text(re.compile(r"^\d+ s$"))
    take_picture(ann.page, "label-no-worker")
    health = ann.page.request.get(f"{server.url}/api/health")
    assert health.status == 503 and health.json()["waiting"] == 1
    ann.drag("tx", 0.02)  # by hand it goes on
    ann.page.locator("#cancel").click()
    ann.events("snap_cancelled")
    expect(status).to_contain_text("Snap cancelled")

    ann.page.keyboard.press("Space")
    cluster.scale(1)
    ann.events("snap_applied")

    assert ann.page.request.post(f"{ann.url}/snaps", data={"config": SLOW_SNAP}).ok
    expect(status).to_contain_text("The worker takes long", timeout=SLOWEST)
    take_picture(ann.page, "label-slow-worker")
    page = ann.page.context.new_page()
    page.goto(server.url)
    other = LabellingPage(page, server, "box")
    page.keyboard.press("Space")
    expect(page.locator("#snap-status")).to_contain_text("yours is next", timeout=SLOWEST)
    take_picture(page, "label-all-workers-busy")
    assert page.request.delete(f"{server.url}/api/snaps/{ann.state['snap']['id']}").ok
    other.events("snap_applied")


def test_the_list_of_tasks_tells_how_far_objects_are_prepared(
    server: Server, cluster: LocalCluster, open_page: Callable[[str], Page]
) -> None:
    page = open_page(server.sign_in_link)
    note = page.locator(".dataset-preparation")
    expect(note).to_have_text("Preparing objects for snaps: 0 of 5 done.")
    take_picture(page, "home-preparing")
    cluster.scale(1)
    expect(note).to_be_hidden(timeout=3 * SLOWEST)  # it builds five objects
    (dataset,) = page.request.get(f"{server.url}/api/datasets").json()["items"]
    assert (dataset["objects_prepared"], dataset["problems"]) == (5, [])
