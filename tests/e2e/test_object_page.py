"""The page of an object: its mesh with its axes, suggestions played as turns, and what a lead decides."""

import io
import json
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from registration_core.geometry import pose
from tests.app.small_dataset import BLOCK, NAME, true_pose, write_small_dataset
from tests.app.waiting import wait_until
from tests.e2e.conftest import take_picture
from tests.e2e.page_rules import NAMELESS
from tests.processes import Server

pytestmark = pytest.mark.e2e

DARK_PIXELS = """canvas => {
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  return data.filter((_, i) => i % 4 === 3 && data[i] > 0).length;
}"""

YELLOW_AND_RED = """() => {
  const canvas = document.querySelector("#mesh");
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  let yellow = 0, red = 0;
  for (let i = 0; i < data.length; i += 4) {
    if (data[i] < 100 || data[i + 2] > data[i] / 2) continue;
    if (data[i + 1] > data[i] / 2) yellow += 1;
    else red += 1;
  }
  return yellow > 10_000 && red > 1_000;
}"""


@pytest.fixture
def dataset(server: Server, tmp_path: Path, request: pytest.FixtureRequest) -> str:
    """The small dataset under a name of its own; neither of its objects has symmetries."""
    name = f"{NAME} {request.node.name}"
    server.command("import", str(write_small_dataset(tmp_path / NAME)), "--name", name)
    return name


class ObjectPage:
    """Somebody before the block's page, on the way that its dataset's card shows."""

    def __init__(self, page: Page, server: Server, dataset: str) -> None:
        self.page, self.url = page, server.url
        page.wait_for_url(f"{server.url}/")
        page.get_by_role("link", name=f"Objects of {dataset}").click()
        page.wait_for_url(re.compile(r"/objects/\d+$"))
        expect(page.locator("#name")).to_have_text("block")
        self.id = int(page.url.rsplit("/", 1)[1])

    def tells(self) -> dict[str, Any]:
        """The object, as the server tells it."""
        return self.page.request.get(f"{self.url}/api/objects/{self.id}").json()

    def wait_for_version(self, version: int) -> dict[str, Any]:
        """The object once this version of its symmetries is there, and the page shows it."""
        expect(self.page.locator("#version")).to_have_text(f"version {version}")
        return self.tells()

    def drawn(self, canvas: str) -> int:
        """How many pixels a canvas shows."""
        return self.page.locator(canvas).evaluate(DARK_PIXELS)


def test_an_object_is_shown_in_its_own_colours(server: Server, open_page: Callable[[str], Page]) -> None:
    page = open_page(server.new_link("looks at colours", "admin"))
    page.wait_for_url(f"{server.url}/")
    objects = page.request.get(f"{server.url}/api/objects?dataset_id=1").json()["items"]
    box = next(one["id"] for one in objects if one["name"] == "box")  # yellow, with red stripes
    page.goto(f"{server.url}/objects/{box}")
    page.wait_for_function(YELLOW_AND_RED)
    take_picture(page, "object-in-its-colours")


def test_a_lead_plays_accepts_changes_and_takes_back(
    server: Server, dataset: str, open_page: Callable[[str], Page]
) -> None:
    shown = ObjectPage(open_page(server.new_link("symmetry-lead", "admin")), server, dataset)
    page = shown.page
    expect(page.locator("#suggestions li")).to_have_count(5)
    first = page.locator("#suggestions li").first
    expect(first).to_contain_text("Quarter turns about x", ignore_case=True)
    expect(first).to_contain_text(re.compile(r"misses by 0\.0\d mm, 0\.\d %"))
    expect(page.locator("#facts")).to_contain_text("40.0 × 60.0 × 60.0 mm")
    expect(page.locator("#axes text.ruler")).to_have_text(["x 40.0 mm", "y 60.0 mm", "z 60.0 mm"])
    assert shown.drawn("#mesh") > 10_000 and shown.drawn("#rest") == 0
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        take_picture(page, f"object-suggested-{scheme}")

    first.get_by_role("button", name="Play").click()
    expect(page.locator("#caption")).to_contain_text(re.compile(r"turned by [1-9]\d*°"))
    assert shown.drawn("#rest") > 100  # the outline at rest
    take_picture(page, "object-played")
    page.get_by_role("button", name="Stop").click()
    expect(page.locator("#caption")).to_be_empty()
    assert shown.drawn("#rest") == 0

    first.get_by_role("button", name="Accept").click()
    accepted = shown.wait_for_version(2)
    assert len(accepted["symmetries"]["discrete"]) == 3 and not accepted["suggestions_open"]
    page.get_by_role("button", name="Accept all").click()
    assert len(shown.wait_for_version(3)["symmetries"]["discrete"]) == 7
    page.get_by_role("button", name="Undo").click()
    assert shown.wait_for_version(4)["axes"] == accepted["axes"]
    take_picture(page, "object-accepted")
    page.get_by_role("button", name="Change axis A").click()
    page.locator("#fold").select_option("2")
    page.locator("#save").click()
    assert [axis["fold"] for axis in shown.wait_for_version(5)["axes"]] == [2]
    page.get_by_role("button", name="Remove axis A").click()
    assert shown.wait_for_version(6)["axes"] == []
    expect(page.locator("#present-text")).to_have_text("None, as was decided.")
    page.locator("#history summary").click()
    expect(page.locator("#versions li")).to_have_count(6)
    page.get_by_role("button", name="Bring version 3 back").click()
    assert len(shown.wait_for_version(7)["symmetries"]["discrete"]) == 7
    seen = page.locator("body").aria_snapshot()
    assert [line for line in seen.splitlines() if NAMELESS.match(line)] == []


def test_an_axis_goes_through_two_points_that_are_picked(
    server: Server, dataset: str, open_page: Callable[[str], Page]
) -> None:
    shown = ObjectPage(open_page(server.new_link("symmetry-picker", "admin")), server, dataset)
    page = shown.page
    page.get_by_role("button", name="Add an axis").click()
    page.locator("#pick").click()
    expect(page.locator("#pick-next")).to_contain_text("first point")
    box = page.locator("#mesh").bounding_box()
    assert box is not None
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.click(middle[0], middle[1] + 30)
    expect(page.locator("#pick-next")).to_contain_text("second point")
    page.mouse.click(middle[0], middle[1] - 30)
    expect(page.locator("#pick-next")).to_be_empty()
    numbers = [float(page.locator(f"#axis-{k}").input_value()) for k in "xyz"]
    assert np.linalg.norm(numbers) == pytest.approx(1.0, abs=1e-3)
    points = [float(page.locator(f"#point-{k}").input_value()) for k in "xyz"]
    assert max(np.abs(points) - [20, 30, 30]) < 0.01  # millimetres: on the block
    page.locator("#try").click()
    expect(page.locator("#misses")).to_contain_text("misses by")
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        take_picture(page, f"object-editor-{scheme}")
    page.locator("#axis-x").fill("0")
    page.locator("#axis-y").fill("0")
    page.locator("#axis-z").fill("0")
    page.locator("#save").click()
    expect(page.locator("#message")).to_contain_text("three numbers that are not all 0")
    page.locator("#axis-z").fill("2")
    page.locator("#fold").select_option("")
    for k in "xyz":
        page.locator(f"#point-{k}").fill("0")
    page.locator("#save").click()
    (axis,) = shown.wait_for_version(2)["axes"]
    assert (axis["axis"], axis["point"], axis["fold"]) == ([0, 0, 1], [0, 0, 0], None)
    expect(page.locator("#present li")).to_contain_text(re.compile(r"misses by \d+\.\d\d mm, \d+"))


def test_operators_look_and_leads_say_none(
    server: Server, dataset: str, open_page: Callable[[str], Page]
) -> None:
    operator = ObjectPage(open_page(server.new_link("symmetry-looker")), server, dataset)
    expect(operator.page.locator("#asks-lead")).to_be_visible()
    expect(operator.page.locator("#suggestions li")).to_have_count(5)
    for name in ("Accept", "Add an axis", "It has none", "Undo"):
        expect(operator.page.get_by_role("button", name=name)).to_have_count(0)
    lead = ObjectPage(open_page(server.new_link("symmetry-none", "admin")), server, dataset)
    expect(lead.page.locator("#list .is-open")).to_have_text(["suggested"])
    lead.page.get_by_role("button", name="It has none").click()
    assert lead.wait_for_version(2)["symmetries"] == {"discrete": [], "continuous": []}
    expect(lead.page.locator("#list .is-open")).to_have_count(0)
    lead.page.goto(server.url)
    expect(lead.page.get_by_role("link", name=f"Objects of {dataset}")).to_have_text("2 objects")
    take_picture(lead.page, "home-objects")


def test_from_an_import_without_symmetries_to_an_export_with_them(
    server: Server, dataset: str, open_page: Callable[[str], Page]
) -> None:
    shown = ObjectPage(open_page(server.new_link("symmetry-path", "admin")), server, dataset)
    page = shown.page
    tasks = page.request.get(f"{server.url}/api/tasks?dataset_id={shown.tells()['dataset_id']}").json()[
        "items"
    ]
    task_id = next(task["id"] for task in tasks if task["object"]["name"] == "block")
    labelling = page.context.new_page()
    labelling.goto(f"{server.url}/label/{task_id}")
    expect(labelling.locator("#crumb-object")).to_have_attribute("href", f"/objects/{shown.id}")
    registration = page.request.post(f"{server.url}/api/tasks/{task_id}/registration").json()
    url = f"{server.url}/api/registrations/{registration['id']}"

    def snapped() -> dict[str, Any]:
        half_way = true_pose(BLOCK) @ pose.exp([0, 0, 0, np.pi / 4, 0, 0])  # between twins
        assert page.request.put(f"{url}/pose", data={"T_world_object": half_way.tolist()}).ok
        order = {"seed": 3, "start_spread": [0.02, 1.0]}
        snap_id = page.request.post(f"{url}/snaps", data=order).json()["id"]
        look = f"{server.url}/api/snaps/{snap_id}"
        return wait_until(lambda: page.request.get(look).json()["estimate"], "the snap to end")

    before = snapped()
    expect(labelling.locator("#candidates-title")).to_contain_text("The depth fits")
    labelling.locator("#candidate-next").click()
    wait_until(lambda: page.request.get(url).json()["preview"], "a twin to be looked at")
    page.get_by_role("button", name="Accept all").click()
    accepted = shown.wait_for_version(2)
    expect(labelling.locator("#message")).to_contain_text("symmetries were changed")
    expect(labelling.locator("#candidates")).to_be_hidden()
    wait_until(lambda: page.request.get(url).json()["preview"] is None, "the twin to be put away")
    take_picture(labelling, "label-symmetries-changed")
    after = snapped()
    assert (before["symmetries_version"], after["symmetries_version"]) == (1, 2)
    rivals = [sum(one["weight"] > 0.2 for one in estimate["hypotheses"]) for estimate in (before, after)]
    assert rivals[0] >= 2 and rivals[1] == 1  # the twins are one pose now
    assert page.request.post(f"{url}/submit").ok

    job = page.request.post(f"{server.url}/api/exports", data={"dataset_id": accepted["dataset_id"]}).json()
    look = f"{server.url}/api/exports/{job['id']}"
    wait_until(lambda: page.request.get(look).json()["state"] in {"done", "failed"}, "the export to end", 180)
    ended = page.request.get(look).json()
    assert ended["state"] == "done", ended["message"]
    exported = zipfile.ZipFile(io.BytesIO(page.request.get(f"{look}/download").body()))
    (infos,) = [name for name in exported.namelist() if name.endswith("/models/models_info.json")]
    info = json.loads(exported.read(infos))[str(BLOCK)]
    assert len(info["symmetries_discrete"]) == 7
    turns = np.array(info["symmetries_discrete"]).reshape(-1, 4, 4)
    assert np.allclose(
        turns, accepted["symmetries"]["discrete"], atol=1e-6
    )  # about the origin, in mm as in m
    (log,) = [name for name in exported.namelist() if name.endswith("estimates.jsonl")]
    logged = [json.loads(line) for line in exported.read(log).splitlines()]
    assert [entry["symmetries_version"] for entry in logged] == [1, 2]
