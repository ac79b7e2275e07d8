"""Placing by REST: each call moves the object as it says, and is logged with the way it was done."""

from typing import Any

import httpx
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from app.labeling.live.live_session import LiveSession
from registration_core.geometry import pose
from tests.app.export.site import CAMERA, TOOL, mesh_of, model_of
from tests.app.labeling.viser_client import CAMERA as VISER_CAMERA
from tests.app.labeling.viser_client import ViserClient
from tests.app.live import LiveServer
from tests.app.rest import begin, log_of, put_pose, sentence, shown, url_of
from tests.app.small_dataset import NEAR_VIEW, true_pose
from tests.app.waiting import wait_until

MODEL = model_of(mesh_of(TOOL))


@pytest.fixture
def registration(script: httpx.Client) -> dict[str, Any]:
    return begin(script)


def post(client: httpx.Client, registration: dict[str, Any], action: str, **body: Any) -> httpx.Response:
    return client.post(f"{url_of(registration)}/{action}", json=body)


def last_technique(client: httpx.Client, registration: dict[str, Any]) -> str:
    event = log_of(client, registration["id"])[-1]
    assert (event["kind"], event["actor"]) == ("set_pose", "script")
    return event["detail"]["technique"]


def open_view(live: LiveServer, live_session: LiveSession) -> ViserClient:
    """A page that looks from (1, 1, 1) at the origin of the world, with z up."""
    client = ViserClient(live.services.live_sessions.view_socket(live_session))
    view = live_session.view
    assert view is not None
    wait_until(lambda: view.viewpoint is not None, "the page to be known")
    return client


def camera_pose(live_session: LiveSession) -> np.ndarray:
    """T_world_camera of the page."""
    assert live_session.view is not None
    viewpoint = live_session.view.viewpoint
    assert viewpoint is not None
    return viewpoint.T_world_camera


def seen_from_the_corner(client: ViserClient) -> None:
    """What a browser sends when its camera has found its place; viser turns (w, x, y, z) into axes."""
    z = -np.ones(3) / np.sqrt(3)
    x = np.cross(z, [0, 0, 1]) / np.linalg.norm(np.cross(z, [0, 0, 1]))
    R = np.stack([x, np.cross(z, x), z], axis=1)
    wxyz = Rotation.from_matrix(R).as_quat(scalar_first=True).tolist()
    client.send("ViewerCameraMessage", **(VISER_CAMERA | {"wxyz": wxyz}))


# -- nudges


@pytest.mark.parametrize("axes", ["view", "object", "world"])
def test_a_nudge_goes_along_the_named_axes_and_back(
    script: httpx.Client, registration: dict[str, Any], axes: str
) -> None:
    T = shown(put_pose(script, registration, true_pose(TOOL)))
    R = {"view": NEAR_VIEW[:3, :3], "object": T[:3, :3], "world": np.eye(3)}[axes]
    moved = shown(post(script, registration, "nudge", axes=axes, translation=[0.002, 0, -0.001]))
    assert moved[:3, 3] - T[:3, 3] == pytest.approx(R @ [0.002, 0, -0.001])
    turned = shown(post(script, registration, "nudge", axes=axes, rotation=[0, 0.1, 0]))
    assert pose.apply(turned, MODEL.centre) == pytest.approx(pose.apply(moved, MODEL.centre))
    post(script, registration, "nudge", axes=axes, rotation=[0, -0.1, 0])
    back = shown(post(script, registration, "nudge", axes=axes, translation=[-0.002, 0, 0.001]))
    assert back == pytest.approx(T, abs=1e-9)
    assert last_technique(script, registration) == "nudge"


def test_turns_and_flips_are_logged_as_such(script: httpx.Client, registration: dict[str, Any]) -> None:
    for technique, angle in (("turn", np.pi / 2), ("flip", np.pi)):
        before = np.array(script.get(url_of(registration)).json()["T_world_object"])
        body = {"axes": "object", "rotation": [angle, 0, 0], "technique": technique}
        after = shown(post(script, registration, "nudge", **body))
        assert pose.distance(before, after).rotation == pytest.approx(angle)
        assert last_technique(script, registration) == technique


def test_the_views_axes_are_those_of_the_open_page(
    live: LiveServer, script: httpx.Client, registration: dict[str, Any]
) -> None:
    T = shown(put_pose(script, registration, true_pose(TOOL)))
    live_session = live.live_session(registration["id"])
    with open_view(live, live_session) as client:
        seen_from_the_corner(client)
        away = -np.ones(3) / np.sqrt(3)
        wait_until(lambda: np.allclose(camera_pose(live_session)[:3, 2], away), "the camera's place")
        moved = shown(post(script, registration, "nudge", axes="view", translation=[0, 0, 0.01]))
    assert moved[:3, 3] - T[:3, 3] == pytest.approx(0.01 * away)


BAD_NUDGES: dict[str, dict[str, Any]] = {
    "axes": {"axes": "mine"},
    "translation": {"axes": "world", "translation": [0, 0, 1e9]},
    "rotation": {"axes": "world", "rotation": [0, 0]},
    "technique": {"axes": "world", "technique": "drag"},
}


@pytest.mark.parametrize("name", BAD_NUDGES)
def test_a_wrong_nudge_is_refused_by_name(
    script: httpx.Client, registration: dict[str, Any], name: str
) -> None:
    assert name in sentence(post(script, registration, "nudge", **BAD_NUDGES[name]), 422)
    assert script.get(url_of(registration)).json() == registration


# -- putting down and placing


def test_an_object_in_the_air_is_put_down_on_the_table(
    script: httpx.Client, registration: dict[str, Any]
) -> None:
    T = pose.exp([0, 0, 0.06, 0, 0, 0]) @ true_pose(TOOL)
    put_pose(script, registration, T)
    rested = shown(post(script, registration, "rest"))
    assert rested[:3, :3] == pytest.approx(T[:3, :3])
    lowest = pose.apply(rested, MODEL.vertices)[:, 2].min()
    assert lowest == pytest.approx(0.0, abs=0.001)  # what the depth image knows of the table
    assert last_technique(script, registration) == "rest"


def test_where_there_is_no_surface_nothing_is_put_down(
    script: httpx.Client, registration: dict[str, Any]
) -> None:
    put_pose(script, registration, pose.exp([0, 0, 5.0, 0, 0, 0]))
    before = script.get(url_of(registration)).json()
    assert "no flat surface" in sentence(post(script, registration, "rest"), 409)
    assert script.get(url_of(registration)).json() == before


def pixel_of(point: np.ndarray) -> dict[str, float]:
    x, y, z = pose.apply(pose.inverse(NEAR_VIEW), point)
    return {"column": CAMERA.fx * x / z + CAMERA.cx, "row": CAMERA.fy * y / z + CAMERA.cy}


def test_a_click_on_the_object_in_the_image_brings_it_there(
    script: httpx.Client, registration: dict[str, Any]
) -> None:
    T = pose.exp([0.2, 0.1, 0.3, 0, 0, 0]) @ true_pose(TOOL)
    put_pose(script, registration, T)
    centre = pose.apply(true_pose(TOOL), MODEL.centre)
    pixel = pixel_of(centre)
    placed = shown(post(script, registration, "place", frame_id=registration["frame_id"], **pixel))
    assert placed[:3, :3] == pytest.approx(T[:3, :3])
    assert pose.apply(placed, MODEL.centre) == pytest.approx(centre, abs=0.005)
    assert last_technique(script, registration) == "place"


def test_a_click_on_the_table_in_the_view_lets_it_stand_there(
    live: LiveServer, script: httpx.Client, registration: dict[str, Any]
) -> None:
    live_session = live.live_session(registration["id"])
    with open_view(live, live_session) as client:
        seen_from_the_corner(client)
        wait_until(lambda: camera_pose(live_session)[2, 2] < 0, "the camera's place")
        x, y, z = pose.apply(pose.inverse(camera_pose(live_session)), [0.12, -0.1, 0.0])
        half = np.tan(VISER_CAMERA["fov"] / 2)
        across, down = 0.5 + x / z / half * 600 / 800 / 2, 0.5 + y / z / half / 2
        placed = shown(post(script, registration, "place", across=across, down=down))
        assert pose.apply(placed, MODEL.centre)[:2] == pytest.approx([0.12, -0.1], abs=0.015)
        assert pose.apply(placed, MODEL.vertices)[:, 2].min() == pytest.approx(0.0, abs=0.001)
        assert "no point of the cloud" in sentence(
            post(script, registration, "place", across=0.0, down=0.0), 409
        )


def test_pointing_at_nothing_is_said(script: httpx.Client, registration: dict[str, Any]) -> None:
    frame_id = registration["frame_id"]
    outside = post(script, registration, "place", frame_id=frame_id, column=-3, row=10)
    assert "column" in sentence(outside, 422)
    foreign = post(script, registration, "place", frame_id=999, column=3, row=10)
    assert "does not belong" in sentence(foreign, 409)
    assert "Nobody has the 3-D view" in sentence(
        post(script, registration, "place", across=0.5, down=0.5), 409
    )
    assert len(log_of(script, registration["id"])) == 1


# -- the view


@pytest.mark.parametrize("at", ["sensor", "top", "front", "side", "object", "left", "right"])
def test_the_view_looks_from_elsewhere_and_nothing_is_logged(
    live: LiveServer, script: httpx.Client, registration: dict[str, Any], at: str
) -> None:
    T = shown(put_pose(script, registration, true_pose(TOOL)))
    live_session = live.live_session(registration["id"])
    logged = log_of(script, registration["id"])
    with open_view(live, live_session) as client:
        seen_from_the_corner(client)
        wait_until(lambda: camera_pose(live_session)[2, 2] < 0, "the camera's place")
        assert post(script, registration, "look", at=at).status_code == 204
        position = np.array(
            client.wait_for("SetCameraPositionMessage", lambda m: not m["initial"])["position"]
        )
    centre = pose.apply(T, MODEL.centre)
    outward = (position - centre) / np.linalg.norm(position - centre)
    if at == "sensor":
        assert position == pytest.approx(NEAR_VIEW[:3, 3], abs=1e-6)
    elif at == "top":
        assert outward == pytest.approx([0, 0, 1], abs=0.05)
    elif at == "front":
        assert outward[1] < -0.9
    elif at == "side":
        assert outward[0] > 0.9
    elif at == "object":
        assert np.linalg.norm(position - centre) < 0.5
    else:
        before, after = np.ones(3) - centre, position - centre
        assert np.linalg.norm(after) == pytest.approx(np.linalg.norm(before))
        angle = np.angle(complex(*after[:2]) / complex(*before[:2]))
        assert angle == pytest.approx(np.radians(-30 if at == "left" else 30), abs=1e-3)
    assert log_of(script, registration["id"]) == logged


def test_the_view_stays_during_a_drag_and_without_a_page(
    live: LiveServer, script: httpx.Client, registration: dict[str, Any]
) -> None:
    assert "Nobody has the 3-D view" in sentence(post(script, registration, "look", at="top"), 409)
    live_session = live.live_session(registration["id"])
    with open_view(live, live_session):
        live_session.session.start_drag()
        assert "being dragged" in sentence(post(script, registration, "look", at="top"), 409)
        assert "being dragged" in sentence(post(script, registration, "rest"), 409)
        live_session.session.end_drag()


def test_the_gizmos_axes_are_chosen(
    live: LiveServer, script: httpx.Client, registration: dict[str, Any]
) -> None:
    assert registration["gizmo_axes"] == "object"
    url = f"{url_of(registration)}/gizmo"
    assert script.put(url, json={"axes": "world"}).json()["gizmo_axes"] == "world"
    session = live.live_session(registration["id"]).session
    T = np.array(registration["T_world_object"])
    session.start_drag()
    assert "being dragged" in sentence(script.put(url, json={"axes": "object"}), 409)
    session.drag_to(pose.exp([0.01, 0, 0, 0, 0, 0]) @ T)
    session.end_drag()
    event = log_of(script, registration["id"])[-1]
    assert (event["dof"], event["detail"]) == (["tx"], {"axes": "world"})
    assert "axes" in sentence(script.put(url, json={"axes": "view"}), 422)
