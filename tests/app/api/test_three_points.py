"""Three points by REST alone: pairs of points in, the pose and how well they agree on it out."""

from typing import Any

import httpx
import numpy as np
import pytest

from app.labeling.moves.placement import measured_points, point_at_pixel
from app.storage.roles import Role
from registration_core.geometry import pose
from tests.app.api.test_placement import open_view, pixel_of
from tests.app.export.site import CAMERA, TOOL, mesh_of, model_of, observed_depth
from tests.app.live import LiveServer
from tests.app.rest import begin, finished_snap, log_of, sentence, shown, url_of
from tests.app.small_dataset import NEAR_VIEW, true_pose

MODEL = model_of(mesh_of(TOOL))
LEAST_SPREAD = 0.08


@pytest.fixture
def registration(script: httpx.Client) -> dict[str, Any]:
    return begin(script)


def post(client: httpx.Client, registration: dict[str, Any], pairs: list[dict[str, Any]]) -> httpx.Response:
    return client.post(f"{url_of(registration)}/three-points", json={"pairs": pairs})


def far_apart(points: np.ndarray, count: int) -> np.ndarray:
    """Some of the points (N, 3), far from each other (count, 3)."""
    chosen = [0]
    while len(chosen) < count:
        apart = np.linalg.norm(points[:, None] - points[chosen], axis=2).min(axis=1)
        chosen.append(int(apart.argmax()))
    return points[chosen]


def corners(count: int = 4) -> np.ndarray:
    """Vertices of the object far from each other (count, 3)."""
    return far_apart(MODEL.vertices, count)


def pairs_of(points: np.ndarray, T: np.ndarray) -> list[dict[str, Any]]:
    in_scene = pose.apply(T, points)
    return [{"on_object": p.tolist(), "in_scene": q.tolist()} for p, q in zip(points, in_scene, strict=True)]


def test_three_true_pairs_give_the_true_pose_and_a_snap_with_their_spread(
    script: httpx.Client, registration: dict[str, Any]
) -> None:
    truth = true_pose(TOOL)
    pairs = pairs_of(corners(3), truth)
    answer = post(script, registration, pairs)
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert np.array(found["registration"]["T_world_object"]) == pytest.approx(truth, abs=1e-9)
    assert found["residuals"] == pytest.approx([0, 0, 0], abs=1e-9)
    assert found["rms"] == pytest.approx(0, abs=1e-9)
    assert 0 < found["start_spread"][0] < LEAST_SPREAD
    assert finished_snap(script, found["snap_id"])["estimate"]["start_spread"] == found["start_spread"]
    placed, asked = log_of(script, registration["id"])[1:3]
    assert (placed["kind"], placed["actor"], asked["kind"]) == ("set_pose", "script", "snap_requested")
    detail = placed["detail"]
    assert detail["technique"] == "three points"
    assert [pair["on_object"] for pair in detail["pairs"]] == [pair["on_object"] for pair in pairs]
    assert detail["pairs"][2]["in_world"] == pytest.approx(pairs[2]["in_scene"])
    assert detail["residuals"] == found["residuals"]
    for _ in range(2):  # the snap, then the three points
        back = script.post(f"{url_of(registration)}/undo")
    assert shown(back) == pytest.approx(np.array(registration["T_world_object"]))


def test_pixels_do_as_well_as_points_and_the_residuals_are_said(
    script: httpx.Client, registration: dict[str, Any]
) -> None:
    truth = true_pose(TOOL)
    points = visible_points(truth)
    pairs = [
        {
            "on_object": point.tolist(),
            "in_scene": {"frame_id": registration["frame_id"], **pixel_of(pose.apply(truth, point))},
        }
        for point in points
    ]
    answer = post(script, registration, pairs)
    assert answer.status_code == 200, answer.text
    found = answer.json()
    T = np.array(found["registration"]["T_world_object"])
    in_world = [pair["in_world"] for pair in log_of(script, registration["id"])[1]["detail"]["pairs"]]
    misses = np.linalg.norm(pose.apply(T, points) - in_world, axis=1)
    assert found["residuals"] == pytest.approx(misses.tolist())
    assert found["rms"] == pytest.approx(np.sqrt((misses**2).mean()))
    assert np.linalg.norm(pose.apply(T, MODEL.centre) - pose.apply(truth, MODEL.centre)) < 0.01


def visible_points(truth: np.ndarray) -> np.ndarray:
    """Four points of the object that the camera sees, off its edges and far apart (4, 3), in its frame."""
    depth = observed_depth(NEAR_VIEW)
    seen = measured_points(depth, CAMERA, NEAR_VIEW)
    seen = seen[seen[:, 2] > 0.01]  # the table is at 0
    points = pose.apply(pose.inverse(truth), seen)
    on_object = np.linalg.norm(points - MODEL.centre, axis=1) < MODEL.radius
    as_measured = [point_at_pixel(depth, CAMERA, NEAR_VIEW, **pixel_of(point)) for point in seen[on_object]]
    off_edges = np.linalg.norm(np.array(as_measured) - seen[on_object], axis=1) < 0.001
    return far_apart(points[on_object][off_edges], 4)


def test_a_task_without_a_machine_gets_the_pose_alone(live: LiveServer, script: httpx.Client) -> None:
    task = script.get("/api/tasks").json()["items"][0]
    wanted = {"scene_id": task["scene"]["id"], "object_id": task["object"]["id"], "condition": "manual"}
    task_id = live.script("lead", Role.ADMIN).post("/api/tasks", json=wanted).json()["id"]
    registration = script.post(f"/api/tasks/{task_id}/registration").json()
    found = post(script, registration, pairs_of(corners(), true_pose(TOOL))).json()
    assert found["snap_id"] is None
    assert [event["kind"] for event in log_of(script, registration["id"])] == ["opened", "set_pose"]


def test_what_cannot_carry_a_pose_is_refused_and_nothing_moves(
    script: httpx.Client, registration: dict[str, Any]
) -> None:
    pairs = pairs_of(corners(), true_pose(TOOL))
    assert "three points or more; it holds 2" in sentence(post(script, registration, pairs[:2]), 422)
    assert "three points or more; it holds 0" in sentence(post(script, registration, []), 422)
    twice = sentence(post(script, registration, [pairs[0], pairs[1], pairs[0]]), 422)
    assert twice.startswith("The points on the object must lie apart")
    wrong = [*pairs[:3], pairs[3] | {"in_scene": [0.3, 0.3, 0.3]}]
    misfit = sentence(post(script, registration, wrong), 422)
    assert misfit.startswith("The points in the scene must match the points on the object; pair 4")
    beside = pairs[0] | {"in_scene": {"frame_id": registration["frame_id"], "column": -5, "row": 1}}
    assert "column" in sentence(post(script, registration, [beside, *pairs[1:]]), 422)
    assert "on_object" in sentence(post(script, registration, [pairs[0] | {"on_object": [1, 2]}]), 422)
    assert script.get(url_of(registration)).json() == registration


def test_a_point_is_told_and_marks_are_drawn_where_the_view_is_open(
    live: LiveServer, script: httpx.Client, registration: dict[str, Any]
) -> None:
    url = url_of(registration)
    centre = pose.apply(true_pose(TOOL), MODEL.centre)
    pixel = {"frame_id": registration["frame_id"], **pixel_of(centre)}
    point = script.post(f"{url}/point", json=pixel).json()["point_world"]
    assert np.linalg.norm(np.array(point) - centre) < MODEL.radius
    marks = {"points_world": [point, [0, 0, 0]]}
    assert "Nobody has the 3-D view" in sentence(script.put(f"{url}/marks", json=marks), 409)
    with open_view(live, live.live_session(registration["id"])) as client:
        assert script.put(f"{url}/marks", json=marks).status_code == 204
        label = client.node("LabelMessage", "/marks/1/number")
        assert label["props"]["text"] == "1"
        client.node("LabelMessage", "/marks/2/number")
        assert script.put(f"{url}/marks", json={"points_world": []}).status_code == 204
        client.wait_for("RemoveSceneNodeMessage", lambda message: message["name"].startswith("/marks"))
    assert script.get(url).json() == registration


def test_nobody_else_may(live: LiveServer, registration: dict[str, Any]) -> None:
    stranger = live.script("mallory")
    assert post(stranger, registration, pairs_of(corners(), true_pose(TOOL))).status_code == 404
    url = url_of(registration)
    assert stranger.post(f"{url}/point", json={"across": 0.5, "down": 0.5}).status_code == 404
    assert stranger.put(f"{url}/marks", json={"points_world": []}).status_code == 404
