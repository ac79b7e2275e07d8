"""Ways to start with mouse and keys: three points on the object and in the scene, another operator's pose."""

import itertools
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import open3d
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Page, expect
from scipy.spatial.transform import Rotation

from app.labeling.moves.placement import point_at_pixel
from registration_core import Intrinsics
from registration_core.bop.images import read_depth
from registration_core.geometry import pose
from tests.e2e.conftest import drawing_finely, take_picture
from tests.e2e.gizmo import pixel
from tests.e2e.precise_labelling_page import DEMO, MODEL, PreciseLabellingPage, true_pose
from tests.processes import Server

pytestmark = pytest.mark.e2e

Array = NDArray[np.float64]

DISTANCE, FILLED = 4.0, 0.84
"""How the view of the object stands to its sphere, as in static/shared/drawing/object-view.js."""
SLOW = 60_000
"""Milliseconds: what an answer may take on a busy machine."""
TURN = 0.01
"""Radians to a pixel of a drag there."""


@pytest.fixture
def labelling(
    server: Server, open_page: Callable[[str], Page], request: pytest.FixtureRequest
) -> PreciseLabellingPage:
    """A new operator before the bottle of the first scene."""
    name = re.sub(r"\W", "-", request.node.name)[:60]
    return PreciseLabellingPage(drawing_finely(open_page(server.new_link(name))), server, "bottle")


class ObjectView:
    """Where points of the object are in its own view."""

    def __init__(self, labelling: PreciseLabellingPage) -> None:
        self.page = labelling.page
        self.rotation = (pose.inverse(labelling.T_world_camera) @ labelling.pose)[:3, :3]
        low, high = MODEL.vertices.min(axis=0), MODEL.vertices.max(axis=0)
        self.middle = (low + high) / 2
        self.radius = np.linalg.norm(MODEL.vertices - self.middle, axis=1).max()

    @property
    def eye(self) -> Array:
        """In the object's frame (3,)."""
        return self.middle - self.rotation.T @ [0, 0, DISTANCE * self.radius]

    def drag(self, right: float, down: float) -> None:
        box = self.page.locator("#pairs-object").bounding_box()
        assert box is not None
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        self.page.mouse.move(x + right, y + down)
        self.page.mouse.up()
        turn = Rotation.from_rotvec([TURN * down, -TURN * right, 0]).as_matrix()
        self.rotation = turn @ self.rotation

    def click(self, point: Array) -> None:
        box = self.page.locator("#pairs-object").bounding_box()
        assert box is not None
        x, y, z = self.rotation @ (point - self.middle) + [0, 0, DISTANCE * self.radius]
        focal = FILLED * box["height"] * np.sqrt(DISTANCE**2 - 1) / 2
        across, down = box["width"] / 2 + focal * x / z, box["height"] / 2 + focal * y / z
        self.page.mouse.click(box["x"] + across, box["y"] + down)


def well_seen(*eyes: Array) -> Array:
    """Points of the object (N, 3), in its frame, that none of the eyes (3,) there sees at a grazing angle."""
    rays: Any = open3d.t.geometry.RaycastingScene()
    tensor: Any = open3d.core.Tensor  # whose stubs know no arrays
    rays.add_triangles(MODEL.vertices.astype(np.float32), MODEL.faces.astype(np.uint32))
    corners = MODEL.vertices[MODEL.faces]
    points = corners.mean(axis=1)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    seen = np.ones(len(points), dtype=bool)
    for eye in eyes:
        towards = points - eye
        far = np.linalg.norm(towards, axis=1)
        lines = np.hstack([np.broadcast_to(eye, points.shape), towards / far[:, None]]).astype(np.float32)
        hit = rays.cast_rays(tensor(lines))["t_hit"].numpy()
        seen &= (np.abs(hit - far) < 1e-4) & (np.abs((normals * towards).sum(axis=1)) > 0.5 * far)
    return points[seen]


def measured(labelling: PreciseLabellingPage, points: Array, T_world_object: Array) -> Array:
    """Those of the points (N, 3), in the object's frame, that the sensor saw, nothing before them."""
    info, T_world_camera, folder = labelling.frame_info, labelling.T_world_camera, DEMO / "test/000001"
    depth = read_depth(folder / f"depth/{info['image_id']:06d}.png", info["depth_scale"])
    camera = Intrinsics(info["width"], info["height"], **info["intrinsics"])
    in_world = pose.apply(T_world_object, points)
    x, y, z = pose.apply(pose.inverse(T_world_camera), in_world).T
    pixels = zip(camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy, strict=True)
    found = [point_at_pixel(depth, camera, T_world_camera, *at) for at in pixels]
    miss = [np.inf if q is None else np.linalg.norm(p - q) for p, q in zip(in_world, found, strict=True)]
    return points[np.array(miss) < 0.003]


def wide_triangle(points: Array) -> Array:
    """Three of the points (3, 3) that lie far off one line."""
    some = points[np.random.default_rng(1).permutation(len(points))[:40]]
    area = lambda a, b, c: np.linalg.norm(np.cross(b - a, c - a))  # noqa: E731
    return np.array(max(itertools.combinations(some, 3), key=lambda corners: area(*corners)))


def test_three_points_place_the_object_and_a_snap_follows(labelling: PreciseLabellingPage) -> None:
    page = labelling.page
    truth = true_pose(labelling)
    page.keyboard.press("t")
    expect(page.locator("#pairs")).to_be_visible(timeout=SLOW)
    expect(page.locator("#pairs-next")).to_contain_text("point 1 on the object")
    view = ObjectView(labelling)
    view.drag(40, 12)
    sensor = (pose.inverse(truth) @ labelling.T_world_camera)[:3, 3]
    points = wide_triangle(measured(labelling, well_seen(view.eye, sensor), truth))
    in_world = pose.apply(truth, points)

    view.click(points[0])
    expect(page.locator("#object-marks > span")).to_have_text(["1"], timeout=SLOW)
    expect(page.locator("#pairs-next")).to_contain_text("in the cloud or the image")
    page.keyboard.press("Backspace")
    expect(page.locator("#object-marks > span")).to_have_count(0)
    for point, place in zip(points, in_world, strict=True):
        number = page.locator("#object-marks > span").count() + 1
        view.click(point)
        expect(page.locator("#object-marks > span")).to_have_count(number, timeout=SLOW)
        if number == 2:  # once in the cloud
            local = pose.apply(pose.inverse(labelling.pose), place) - MODEL.centre
            page.mouse.click(*pixel(page, labelling.frame, local))
        else:
            page.mouse.click(*labelling.image_place(place))
        expect(page.locator("#image-marks > span")).to_have_count(number, timeout=SLOW)
        if number == 2:
            labelling.frame.wait_for_function("() => window.__viserMutable.nodeRefFromName['/marks/2']")
            take_picture(page, "label-three-points-half-way")

    (event,) = labelling.events("set_pose")
    assert event["detail"]["technique"] == "three points"
    picked = np.array([pair["on_object"] for pair in event["detail"]["pairs"]])
    assert np.linalg.norm(picked - points, axis=1).max() < 0.004
    labelling.events("snap_applied")
    expect(page.locator("#pairs-rms")).to_contain_text("mm (rms)", timeout=SLOW)
    expect(page.locator("#pair-list li")).to_have_count(3)
    assert np.linalg.norm(pose.apply(labelling.pose, MODEL.centre) - pose.apply(truth, MODEL.centre)) < 0.005
    take_picture(page, "label-three-points")
    page.emulate_media(color_scheme="dark")
    take_picture(page, "label-three-points-dark")
    page.keyboard.press("Backspace")
    expect(page.locator("#pairs-rms")).to_be_hidden()
    page.keyboard.press("Escape")
    expect(page.locator("#pairs")).to_be_hidden()
    for count in (1, 2):  # the snap, then the three points
        page.keyboard.press("Control+z")
        labelling.events("undo", count)
    assert np.allclose(labelling.pose, event["T_before"])


def test_pairs_that_do_not_fit_are_said_and_can_be_taken_out(labelling: PreciseLabellingPage) -> None:
    page = labelling.page
    before = labelling.pose
    page.locator("#three-points").click()
    expect(page.locator("#pairs")).to_be_visible(timeout=SLOW)
    view = ObjectView(labelling)
    points = wide_triangle(well_seen(view.eye))
    for number, point in enumerate(points, start=1):
        view.click(point)
        expect(page.locator("#object-marks > span")).to_have_count(number, timeout=SLOW)
    image = page.locator("#color").bounding_box()
    assert image is not None
    for number, share in enumerate((0.1, 0.5, 0.9), start=1):  # across the table
        page.mouse.click(image["x"] + share * image["width"], image["y"] + 0.6 * image["height"])
        expect(page.locator("#image-marks > span")).to_have_count(number, timeout=SLOW)
    expect(page.locator("#message")).to_contain_text("The points in the scene must", timeout=SLOW)
    take_picture(page, "label-three-points-refused")
    page.get_by_role("button", name="Take pair 2 out").click()
    expect(page.locator("#pair-list li")).to_have_count(2)
    page.keyboard.press("p")  # another mode takes its place
    expect(page.locator("#pairs")).to_be_hidden()
    expect(page.locator("#place-mode")).to_be_visible()
    assert np.array_equal(labelling.pose, before)


def test_another_operators_pose_is_copied_by_keys(
    server: Server, open_page: Callable[[str], Page], labelling: PreciseLabellingPage
) -> None:
    colleague = open_page(server.new_link("Nadia"))
    colleague.wait_for_url(f"{server.url}/")
    root = f"{server.url}/api"
    theirs = colleague.request.post(f"{root}/tasks/{labelling.task['id']}/registration").json()
    wanted = pose.exp([0.02, 0, 0.01, 0, 0, 0.3]) @ np.array(theirs["T_world_object"])
    url = f"{root}/registrations/{theirs['id']}"
    colleague.request.put(f"{url}/pose", data={"T_world_object": wanted.tolist()})
    assert colleague.request.post(f"{url}/submit").ok

    page = labelling.page
    page.keyboard.press("c")
    copies = page.locator("#copies")
    expect(copies).to_be_visible(timeout=SLOW)
    expect(copies.locator("button", has_text="Nadia")).to_be_visible()
    page.wait_for_function("() => [...document.querySelectorAll('#copy-list img')].every(i => i.complete)")
    take_picture(page, "label-copy")
    page.keyboard.press("Escape")
    expect(copies).to_be_hidden()
    page.locator("#copy").click()
    copies.locator("button", has_text="Nadia").focus()
    event = labelling.press("Enter")
    assert event["detail"]["technique"] == "copy"
    assert event["detail"]["source"]["registration_id"] == theirs["id"]
    assert np.allclose(labelling.pose, wanted)
    assert labelling.state["state"] == "open"  # Enter has chosen, not submitted
    page.keyboard.press("Control+z")
    labelling.events("undo")
    assert np.allclose(labelling.pose, event["T_before"])
