"""Snaps by REST on real workers: the same result as the library's, and how they end."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from app.api.snaps import INTERRUPTED
from app.datasets.scene_data import camera_of
from app.main import create_services
from app.storage.tables import Object
from registration_core import ALGORITHM, SnapConfig, snap
from registration_core.geometry import pose
from registration_core.geometry.pose_error import adi
from tests.app.api.test_problems import full_disk
from tests.app.conftest import settings_for
from tests.app.live import LiveServer, running_server
from tests.app.rest import SLOW_SNAP, begin, finished_snap, kinds, log_of, sentence, url_of
from tests.app.small_dataset import TOOL, true_pose
from tests.app.waiting import wait_until

NEAR = pose.perturbed(true_pose(TOOL), 0.012, np.radians(10), np.random.default_rng(3))


@pytest.fixture
def near(script: httpx.Client) -> dict[str, Any]:
    """A registration whose object is somewhat off."""
    registration = begin(script)
    answer = script.put(url_of(registration) + "/pose", json={"T_world_object": NEAR.tolist()})
    assert answer.status_code == 200
    return answer.json()


def request_snap(client: httpx.Client, registration: dict[str, Any], **body: object) -> str:
    answer = client.post(f"{url_of(registration)}/snaps", json=body)
    assert answer.status_code == 202, answer.text
    return answer.json()["id"]


@pytest.fixture
def running(script: httpx.Client, near: dict[str, Any]) -> Iterator[str]:
    """A snap that runs for long, on a worker."""
    snap_id = request_snap(script, near, config=SLOW_SNAP)
    wait_until(lambda: script.get(f"/api/snaps/{snap_id}").json()["progress"] > 0, "the snap to run")
    standing = script.get(f"/api/snaps/{snap_id}").json()["standing"]
    assert standing["workers"] == 2 and standing["ahead"] == 0 and standing["seconds"] > 0
    yield snap_id
    script.delete(f"/api/snaps/{snap_id}")


def test_a_snap_by_rest_is_the_librarys_snap(
    live: LiveServer, script: httpx.Client, near: dict[str, Any]
) -> None:
    done = finished_snap(script, request_snap(script, near, seed=7, frames="current"))
    assert (done["state"], done["progress"], done["message"]) == ("done", 1.0, None)
    assert done["standing"] is None
    estimate = done["estimate"]
    frame = live.live_session(near["id"]).frames[near["frame_id"]]
    with live.services.database.read() as session:
        tool = session.get_one(Object, script.get(f"/api/tasks/{near['task_id']}").json()["object"]["id"])
    expected = snap(
        live.services.data.model(tool),
        live.services.data.depth(frame),
        camera_of(frame),
        np.array(near["T_camera_object"]),
        rng=np.random.default_rng(7),
        color=live.services.data.aligned_color(frame),
    )
    assert np.allclose(estimate["T_camera_object"], expected.T_camera_object, atol=1e-7)
    assert estimate["confidence"] == pytest.approx(expected.confidence)
    assert np.allclose(estimate["covariance"], expected.covariance, rtol=1e-4, atol=1e-12)
    assert len(estimate["hypotheses"]) == len(expected.hypotheses)
    assert [tuple(a["axis"]) for a in estimate["ambiguities"]] == [
        pytest.approx(a.axis) for a in expected.ambiguities
    ]
    assert (estimate["evaluations"], estimate["seed"]) == (expected.evaluations, 7)
    assert estimate["algorithm"] == ALGORITHM
    assert SnapConfig.from_dict(estimate["config"]) == SnapConfig()


def test_a_snap_uses_the_frames_that_see_the_object_and_is_checked_by_others(
    live: LiveServer, script: httpx.Client, near: dict[str, Any]
) -> None:
    frames = live.live_session(near["id"]).frames
    shown, other = near["frame_id"], next(id for id in frames if id != near["frame_id"])
    both = finished_snap(script, request_snap(script, near, seed=7))["estimate"]
    assert (both["used_frames"], both["other_frames"], both["frame_id"]) == ([shown, other], [], shown)
    report = script.get(url_of(near)).json()["snap"]["frames"]
    assert report == {"used": 2, "agreeing": 0, "asked": 0}
    for wanted, used in (("current", shown), ([other], other)):
        estimate = finished_snap(script, request_snap(script, near, seed=7, frames=wanted))["estimate"]
        assert (estimate["used_frames"], estimate["frame_id"]) == ([used], shown)
        (said,) = estimate["other_frames"]
        assert said["frame_id"] == (shown if used == other else other)
        assert said["share"] > 0.9
        assert said["agrees"] is True
        T_world_camera = np.array(frames[shown].T_world_camera)
        assert np.allclose(T_world_camera @ estimate["T_camera_object"], estimate["T_world_object"])
        assert (
            adi(
                np.array(estimate["T_world_object"]),
                true_pose(TOOL),
                live.live_session(near["id"]).model.vertices,
            )
            < 0.003
        )
    (*_, requested, applied) = log_of(script, near["id"])
    assert requested["detail"]["used_frames"] == applied["detail"]["used_frames"] == [other]
    assert requested["detail"]["other_frames"] == [shown]
    assert applied["detail"]["other_frames"] == estimate["other_frames"]
    assert script.get(url_of(near)).json()["snap"]["frames"] == {"used": 1, "agreeing": 1, "asked": 1}


def test_the_frames_that_snaps_use_are_chosen_once(script: httpx.Client, near: dict[str, Any]) -> None:
    assert (near["frame_use"], near["frame_uses"]) == ("auto", ["auto", "current"])
    answer = script.put(f"{url_of(near)}/snap-frames", json={"frames": "current"})
    assert answer.json()["frame_use"] == "current"
    estimate = finished_snap(script, request_snap(script, near))["estimate"]
    assert estimate["used_frames"] == [near["frame_id"]]


def test_a_finished_snap_moves_the_object(
    live: LiveServer, script: httpx.Client, near: dict[str, Any]
) -> None:
    snap_id = request_snap(script, near)
    done = finished_snap(script, snap_id)
    state = script.get(url_of(near)).json()
    assert state["T_world_object"] == done["estimate"]["T_world_object"]
    assert state["confidence"] == done["estimate"]["confidence"]
    assert (state["snap"]["id"], state["snap"]["state"]) == (snap_id, "done")
    vertices = live.live_session(near["id"]).model.vertices
    assert adi(np.array(state["T_world_object"]), true_pose(TOOL), vertices) < 0.003
    requested, applied = log_of(script, near["id"])[-2:]
    assert (requested["kind"], requested["actor"]) == ("snap_requested", "script")
    assert (applied["kind"], applied["actor"]) == ("snap_applied", "machine")
    assert requested["snap_id"] == applied["snap_id"] == snap_id
    undone = script.post(f"{url_of(near)}/undo").json()
    assert np.allclose(undone["T_world_object"], NEAR)


def test_the_same_seed_gives_the_same_result(script: httpx.Client, near: dict[str, Any]) -> None:
    found = []
    for _ in range(2):
        found.append(finished_snap(script, request_snap(script, near, seed=11))["estimate"])
        script.post(f"{url_of(near)}/undo")
    assert found[0]["T_world_object"] == found[1]["T_world_object"]
    assert found[0]["confidence"] == found[1]["confidence"]


def test_a_snap_searches_as_far_as_it_is_told_and_can_be_repeated(
    script: httpx.Client, near: dict[str, Any]
) -> None:
    found = []
    for spread in ([0.015, 0.2], [0.015, 0.2], [0.06, 1.0], None):
        snap_id = request_snap(script, near, seed=11, start_spread=spread)
        estimate = finished_snap(script, snap_id)["estimate"]
        requested = next(event for event in log_of(script, near["id"]) if event["snap_id"] == snap_id)
        assert estimate["start_spread"] == requested["detail"]["start_spread"] == spread
        found.append((estimate["T_world_object"], estimate["confidence"]))
        script.post(f"{url_of(near)}/undo")
    assert found[0] == found[1]
    assert len({confidence for _, confidence in found}) == 3


def test_where_nothing_is_told_the_last_drags_tell(
    live: LiveServer, script: httpx.Client, near: dict[str, Any]
) -> None:
    session = live.live_session(near["id"]).session
    session.start_drag()
    session.drag_to(NEAR @ pose.exp([0.05, 0, 0, 0, 0, 0]))
    session.end_drag()
    dragged = finished_snap(script, request_snap(script, near, seed=11))["estimate"]
    assert dragged["start_spread"] == pytest.approx([0.05, SnapConfig().spread.rotation])
    script.post(f"{url_of(near)}/undo")
    told = request_snap(script, near, seed=11, start_spread=dragged["start_spread"])
    again = finished_snap(script, told)["estimate"]
    assert again["T_world_object"] == dragged["T_world_object"]
    assert again["confidence"] == dragged["confidence"]
    script.post(f"{url_of(near)}/undo")
    unknown = finished_snap(script, request_snap(script, near, seed=11, start_spread=None))["estimate"]
    assert unknown["start_spread"] is None and unknown["confidence"] != dragged["confidence"]


def test_a_snap_needs_no_body(script: httpx.Client, near: dict[str, Any]) -> None:
    answer = script.post(f"{url_of(near)}/snaps")
    assert answer.status_code == 202
    assert finished_snap(script, answer.json()["id"])["state"] == "done"


def test_what_was_moved_meanwhile_is_offered(script: httpx.Client, near: dict[str, Any]) -> None:
    short = {"preset": "paper", "particle_filter": {"iterations": 120, "particles": 50}}
    for answer, kind in (("accept", "accept"), ("dismiss", "dismiss")):
        snap_id = request_snap(script, near, config=short, seed=5)
        moved = script.put(f"{url_of(near)}/pose", json={"T_world_object": NEAR.tolist()})
        assert moved.status_code == 200
        found = finished_snap(script, snap_id)["estimate"]
        state = script.get(url_of(near)).json()
        assert np.allclose(state["T_world_object"], NEAR)
        assert state["offer"]["snap_id"] == snap_id
        assert state["offer"]["T_world_object"] == found["T_world_object"]
        after = script.post(f"{url_of(near)}/{answer}").json()
        assert after["offer"] is None
        expected = found["T_world_object"] if answer == "accept" else NEAR
        assert np.allclose(after["T_world_object"], expected)
        assert kinds(script, near["id"])[-3:] == ["set_pose", "snap_offered", kind]
        script.put(f"{url_of(near)}/pose", json={"T_world_object": NEAR.tolist()})


def test_a_snap_can_be_cancelled(script: httpx.Client, near: dict[str, Any], running: str) -> None:
    state = script.get(url_of(near)).json()
    assert state["snap"]["state"] == "running" and 0 < state["snap"]["progress"] < 1
    cancelled = script.delete(f"/api/snaps/{running}")
    assert cancelled.status_code == 200
    assert cancelled.json()["state"] == "cancelled"
    assert cancelled.json()["estimate"] is None
    assert script.get(f"/api/snaps/{running}").json() == cancelled.json()
    assert kinds(script, near["id"])[-1] == "snap_cancelled"
    assert script.delete(f"/api/snaps/{running}").json()["state"] == "cancelled"
    assert kinds(script, near["id"]).count("snap_cancelled") == 1
    assert finished_snap(script, request_snap(script, near))["state"] == "done"


def test_deleting_a_finished_snap_changes_nothing(script: httpx.Client, near: dict[str, Any]) -> None:
    done = finished_snap(script, request_snap(script, near))
    before = kinds(script, near["id"])
    assert script.delete(f"/api/snaps/{done['id']}").json() == done
    assert kinds(script, near["id"]) == before


def test_a_newer_snap_takes_the_place_of_the_older(
    script: httpx.Client, near: dict[str, Any], running: str
) -> None:
    newer = request_snap(script, near)
    assert script.get(f"/api/snaps/{running}").json()["state"] == "cancelled"
    assert finished_snap(script, newer)["state"] == "done"


def test_a_snap_that_cannot_work_says_why(script: httpx.Client, near: dict[str, Any]) -> None:
    far = true_pose(TOOL) @ pose.exp([50.0, 0, 0, 0, 0, 0])
    script.put(f"{url_of(near)}/pose", json={"T_world_object": far.tolist()})
    failed = finished_snap(script, request_snap(script, near))
    assert failed["state"] == "failed" and failed["estimate"] is None
    assert "outside the image" in failed["message"] and failed["message"].endswith(".")
    assert np.allclose(script.get(url_of(near)).json()["T_world_object"], far)


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ({"config": {"particels": 5}}, "config.particels"),
        ({"config": {"particle_filter": {"particles": 0}}}, "config.particle_filter.particles"),
        ({"config": {"particle_filter": {"particles": "many"}}}, "config.particle_filter.particles"),
        ({"config": {"preset": "magic"}}, "config.preset"),
        ({"config": []}, "body.config"),
        ({"seed": -1}, "body.seed"),
        ({"seed": 2**63}, "body.seed"),
        ({"seed": 1.5}, "body.seed"),
        ({"seed": "seven"}, "body.seed"),
        ({"start_spread": 0.03}, "body.start_spread"),
        ({"start_spread": []}, "body.start_spread"),
        ({"start_spread": [0.03]}, "body.start_spread"),
        ({"start_spread": [0.03, 0.3, 0.3]}, "body.start_spread"),
        ({"start_spread": [-0.01, 0.3]}, "body.start_spread.0"),
        ({"start_spread": [1.01, 0.3]}, "body.start_spread.0"),
        ({"start_spread": ["far", 0.3]}, "body.start_spread.0"),
        ({"start_spread": [0.03, -0.1]}, "body.start_spread.1"),
        ({"start_spread": [0.03, 3.2]}, "body.start_spread.1"),
        ({"start_spread": [0.03, None]}, "body.start_spread.1"),
        ({"frames": "all"}, "body.frames"),
        ({"frames": []}, "body.frames"),
        ({"frames": [0]}, "body.frames"),
        ({"frames": [1, 2], "config": {"preset": "paper"}}, "body.frames must name one frame"),
    ],
)
def test_a_bad_wish_names_the_field(
    script: httpx.Client, near: dict[str, Any], body: dict[str, Any], words: str
) -> None:
    before = kinds(script, near["id"])
    assert words in sentence(script.post(f"{url_of(near)}/snaps", json=body), 422)
    assert kinds(script, near["id"]) == before
    assert script.get(url_of(near)).json()["snap"] is None


def test_a_spread_that_is_no_number_is_said(script: httpx.Client, near: dict[str, Any]) -> None:
    for content in ('{"start_spread": [NaN, 0.1]}', '{"start_spread": [0.1, Infinity]}'):
        answer = script.post(
            f"{url_of(near)}/snaps", content=content, headers={"content-type": "application/json"}
        )
        assert "body.start_spread." in sentence(answer, 422)


def test_a_submitted_registration_is_not_snapped(script: httpx.Client, near: dict[str, Any]) -> None:
    script.post(f"{url_of(near)}/submit")
    assert "was submitted" in sentence(script.post(f"{url_of(near)}/snaps"), 409)
    assert kinds(script, near["id"])[-1] == "submit"


def test_submitting_ends_the_snap(script: httpx.Client, near: dict[str, Any], running: str) -> None:
    assert script.post(f"{url_of(near)}/submit").json()["snap"]["state"] == "cancelled"
    assert script.get(f"/api/snaps/{running}").json()["state"] == "cancelled"
    assert kinds(script, near["id"])[-2:] == ["snap_cancelled", "submit"]


def test_snaps_are_their_owners(
    live: LiveServer, script: httpx.Client, near: dict[str, Any], running: str, admin: httpx.Client
) -> None:
    stranger = live.script("wants to cancel")
    for method in ("GET", "DELETE"):
        sentence(stranger.request(method, f"/api/snaps/{running}"), 404)
        sentence(live.stranger().request(method, f"/api/snaps/{running}"), 401)
    assert admin.get(f"/api/snaps/{running}").json()["state"] == "running"
    sentence(admin.delete(f"/api/snaps/{running}"), 404)
    assert script.get(f"/api/snaps/{running}").json()["state"] == "running"


@pytest.mark.parametrize("snap_id", ["0", "made-up", "0" * 32, "%00", "x" * 500])
def test_an_unknown_snap_is_said(script: httpx.Client, snap_id: str) -> None:
    assert "no snap" in sentence(script.get(f"/api/snaps/{snap_id}"), 404)
    assert "no snap" in sentence(script.delete(f"/api/snaps/{snap_id}"), 404)


def test_a_snap_that_the_server_left_unfinished_has_failed(
    live: LiveServer, script: httpx.Client, near: dict[str, Any], running: str, cluster: str, tmp_path: Path
) -> None:
    # what is on the disk now is what a server leaves that is killed now
    left = Path(shutil.copytree(live.services.settings.state_dir, tmp_path / "left"))
    with running_server(create_services(settings_for(left, cluster))) as restarted:
        client = restarted.stranger()
        client.headers.update(script.headers)
        found = client.get(f"/api/snaps/{running}").json()
        assert (found["state"], found["message"], found["estimate"]) == ("failed", INTERRUPTED, None)
        state = client.get(url_of(near)).json()
        assert np.allclose(state["T_world_object"], NEAR) and state["snap"] is None
        assert finished_snap(client, request_snap(client, near))["state"] == "done"


def test_a_result_that_could_not_be_saved_has_failed(own_live: LiveServer) -> None:
    script = own_live.script("robot")
    registration = begin(script)
    url = f"/api/registrations/{registration['id']}"
    config = SLOW_SNAP | {"particle_filter": {"iterations": 400, "particles": 50}}
    snap_id = script.post(f"{url}/snaps", json={"config": config}).json()["id"]
    with full_disk(own_live):
        snap = finished_snap(script, snap_id)
        assert (snap["state"], snap["estimate"]) == ("failed", None)
        assert snap["message"].startswith("The result could not be saved")
        assert script.get(url).json()["T_world_object"] == registration["T_world_object"]
    assert kinds(script, registration["id"]) == ["opened", "snap_requested"]
    again = script.post(f"{url}/snaps").json()["id"]
    assert finished_snap(script, again)["state"] == "done"
