"""The desk opens sessions from the log, keeps them apart by user, and lets go of idle ones."""

import numpy as np
import pytest

from app.auth import Actor, Identity, Role
from app.labeling.desk import NotFoundError, Seat, _same_pose_of
from app.services import Services
from registration_core import SnapConfig, pose
from registration_core.pose_error import adi
from tests.app.labeling.viser_client import ViserClient
from tests.app.rest import SLOW_SNAP
from tests.app.small_dataset import TOOL, true_pose
from tests.app.waiting import wait_until


def sign_up(services: Services, name: str, role: Role = Role.OPERATOR) -> Identity:
    user = services.auth.create_user(name, role)
    return Identity(user.id, user.name, role, Actor.HUMAN)


@pytest.fixture
def ann(services: Services) -> Identity:
    return sign_up(services, "ann")


@pytest.fixture
def seat(services: Services, ann: Identity) -> Seat:
    """Ann before the first task: the angle tool of scene 1."""
    return services.desk.start(1, ann)


def shown(seat: Seat) -> np.ndarray:
    return seat.session.snapshot().T_world_object


def wait_for_snap(seat: Seat) -> str:
    def ended() -> str | None:
        snap = seat.session.snapshot().snap
        return None if snap is None or snap.is_live else snap.state

    return wait_until(ended, "the snap to end")


def test_a_registration_begins_at_the_tasks_start_pose(services, seat, ann):
    task = seat.registration.task
    assert np.array_equal(shown(seat), task.T_world_object_start)
    assert seat.session.snapshot().frame_id == task.frame_id
    assert [event.kind for event in services.log.events(seat.registration.id)] == ["opened"]
    assert services.desk.start(1, ann) is seat
    assert [event.kind for event in services.log.events(seat.registration.id)] == ["opened", "opened"]


def test_an_unknown_task_is_said(services, ann):
    with pytest.raises(NotFoundError, match="no task 999"):
        services.desk.start(999, ann)


def test_each_user_has_a_registration_of_their_own(services, seat, ann):
    bob = sign_up(services, "bob")
    his = services.desk.start(1, bob)
    assert his.registration.id != seat.registration.id
    seat.session.set_pose(true_pose(TOOL), Actor.HUMAN)
    assert not his.session.snapshot().can_undo
    for stranger, seat_of_other in ((ann, his), (bob, seat)):
        with pytest.raises(NotFoundError, match="of yours"):
            services.desk.seat(seat_of_other.registration.id, stranger)
    services.desk.close_idle(0.0)
    with pytest.raises(NotFoundError, match="of yours"):
        services.desk.seat(seat.registration.id, bob)


def test_the_log_may_be_read_by_its_owner_and_by_reviewers(services, seat, ann):
    registration_id = seat.registration.id
    services.desk.check_readable(registration_id, ann)
    services.desk.check_readable(registration_id, sign_up(services, "rita", Role.REVIEWER))
    with pytest.raises(NotFoundError):
        services.desk.check_readable(registration_id, sign_up(services, "bob"))
    with pytest.raises(NotFoundError):
        services.desk.check_readable(999, ann)


def test_a_closed_session_is_gone_on_with_from_its_log(services, seat, ann):
    session, start = seat.session, shown(seat)
    first, second = true_pose(TOOL), true_pose(TOOL) @ pose.exp([0.01, 0, 0, 0, 0, 0])
    other_frame = next(frame_id for frame_id in seat.frames if frame_id != seat.registration.task.frame_id)
    session.set_pose(first, Actor.HUMAN)
    session.set_pose(second, Actor.HUMAN)
    session.show_frame(other_frame, Actor.HUMAN)
    session.undo(Actor.HUMAN)
    assert services.desk.close_idle(0.0) == 1
    again = services.desk.seat(seat.registration.id, ann)
    assert again is not seat
    state = again.session.snapshot()
    assert np.array_equal(state.T_world_object, first)
    assert state.can_undo and state.can_redo and state.frame_id == other_frame
    again.session.redo(Actor.HUMAN)
    assert np.array_equal(shown(again), second)
    again.session.undo(Actor.HUMAN)
    again.session.undo(Actor.HUMAN)
    assert np.array_equal(shown(again), start)


def test_a_submitted_registration_stays_so(services, seat, ann):
    seat.session.set_pose(true_pose(TOOL), Actor.HUMAN)
    seat.session.submit(Actor.HUMAN)
    services.desk.close_idle(0.0)
    again = services.desk.start(1, ann)
    assert again.session.snapshot().state == "submitted"
    assert np.array_equal(shown(again), true_pose(TOOL))


def test_what_is_watched_or_was_used_lately_is_not_idle(services, seat):
    assert services.desk.close_idle(3600.0) == 0
    leave = services.desk.watch(seat)
    assert services.desk.close_idle(0.0) == 0
    leave()
    assert services.desk.close_idle(0.0) == 1
    assert services.desk.close_idle(0.0) == 0


def test_a_snap_finds_the_object_from_nearby(services, seat):
    near = pose.perturbed(true_pose(TOOL), 0.012, np.radians(10), np.random.default_rng(3))
    seat.session.set_pose(near, Actor.HUMAN)
    snap_id = seat.session.snap(Actor.HUMAN, seed=7)
    assert wait_for_snap(seat) == "done"
    vertices = seat.model.vertices
    assert adi(shown(seat), true_pose(TOOL), vertices) < 0.003 < adi(near, true_pose(TOOL), vertices)
    estimate = services.log.estimate(snap_id)
    assert estimate is not None and estimate.seed == 7
    assert np.allclose(estimate.T_world_object, shown(seat))
    T_world_camera = np.array(seat.frames[estimate.frame_id].T_world_camera)
    assert np.allclose(T_world_camera @ estimate.T_camera_object, shown(seat))
    assert SnapConfig.from_dict(estimate.config) == SnapConfig()


def test_every_frame_of_a_scene_gives_the_same_pose(services, seat):
    found = []
    for frame_id in seat.frames:
        seat.session.set_pose(true_pose(TOOL) @ pose.exp([0.008, 0, 0, 0, 0, 0]), Actor.HUMAN)
        seat.session.show_frame(frame_id, Actor.HUMAN)
        seat.session.snap(Actor.HUMAN, seed=1)
        assert wait_for_snap(seat) == "done"
        found.append(shown(seat))
    assert len(found) == 2
    assert all(adi(T, true_pose(TOOL), seat.model.vertices) < 0.003 for T in found)


def test_a_snap_out_of_view_fails_with_a_sentence(services, seat):
    seat.session.set_pose(true_pose(TOOL) @ pose.exp([50.0, 0, 0, 0, 0, 0]), Actor.HUMAN)
    snap_id = seat.session.snap(Actor.HUMAN)
    assert wait_for_snap(seat) == "failed"
    message = seat.session.snapshot().snap.message
    assert "outside the image" in message and message.endswith(".") and not message.endswith("..")
    assert [event.kind for event in services.log.snap_events(snap_id)] == ["snap_requested", "snap_failed"]


def test_closing_a_session_cancels_its_snap(services, seat, ann):
    snap_id = seat.session.snap(Actor.HUMAN, SnapConfig.from_dict(SLOW_SNAP))
    wait_until(lambda: seat.session.snapshot().snap.progress > 0, "the snap to run")
    live = services.desk.live_snap(seat.registration.id)
    assert live is not None and live.id == snap_id and live.is_live
    services.desk.close_idle(0.0)
    assert services.desk.live_snap(seat.registration.id) is None
    assert services.log.snap_events(snap_id)[-1].kind == "snap_cancelled"


def test_the_view_is_made_once_and_goes_with_the_session(services, seat, ann):
    port = services.desk.view_port(seat)
    assert services.desk.view_port(seat) == port
    with ViserClient(f"ws://127.0.0.1:{port}/") as client:
        cloud = client.node("PointCloudMessage", "/cloud")["props"]["points"].reshape(-1, 3)
        expected = services.data.cloud(seat.frames[seat.session.snapshot().frame_id])
        assert np.array_equal(cloud, expected.points)
    services.desk.close_idle(0.0)
    with pytest.raises(ConnectionRefusedError):
        ViserClient(f"ws://127.0.0.1:{port}/")
    again = services.desk.seat(seat.registration.id, ann)
    with ViserClient(f"ws://127.0.0.1:{services.desk.view_port(again)}/") as client:
        client.node("MeshMessage", "/object/mesh")


def test_the_view_shows_the_ghost_of_what_is_live_until_it_is_taken(services, seat):
    near = pose.perturbed(true_pose(TOOL), 0.012, np.radians(10), np.random.default_rng(3))
    with ViserClient(f"ws://127.0.0.1:{services.desk.view_port(seat)}/") as client:
        seat.session.set_pose(near, Actor.HUMAN)
        seat.session.set_live(True, Actor.HUMAN)
        live = wait_until(lambda: seat.session.snapshot().live, "a live result")
        centre = pose.apply(live.T_world_object, seat.model.centre)
        client.wait_for(
            "SetPositionMessage",
            lambda m: m["name"] == "/ghost" and np.allclose(m["position"], centre, atol=1e-5),
        )
        seat.session.accept(Actor.HUMAN)
        client.wait_for("SetSceneNodeVisibilityMessage", lambda m: m["name"] == "/ghost" and not m["visible"])


def test_two_poses_are_the_same_where_both_would_be_called_right(seat):
    same = _same_pose_of(seat.model)
    for share, expected in ((0.04, True), (0.06, False)):
        moved = true_pose(TOOL) @ pose.exp([share * seat.model.diameter, 0, 0, 0, 0, 0])
        assert same(moved, true_pose(TOOL)) is expected


def test_the_view_follows_the_session_and_the_session_the_view(services, seat):
    T_object_gizmo = pose.from_rotation_translation(np.eye(3), seat.model.centre)

    def arrived_at(T_world_object):
        expected = (T_world_object @ T_object_gizmo)[:3, 3]
        return lambda m: m["name"] == "/object" and np.allclose(m["position"], expected, atol=1e-5)

    with ViserClient(f"ws://127.0.0.1:{services.desk.view_port(seat)}/") as client:
        seat.session.set_pose(true_pose(TOOL), Actor.SCRIPT)
        client.wait_for("SetPositionMessage", arrived_at(true_pose(TOOL)))
        dragged = true_pose(TOOL) @ T_object_gizmo @ pose.exp([0, 0, 0, 0, 0, 0.4])
        client.drag([dragged])

        def drags():
            return [event for event in services.log.events(seat.registration.id) if event.kind == "drag"]

        (event,) = wait_until(drags, "the drag")
        assert (event.actor, event.dof) == ("human", ["rz"])
        assert np.allclose(event.T_after, dragged @ pose.inverse(T_object_gizmo), atol=1e-9)
        other_frame = max(seat.frames)
        count = len([m for m in client.messages if m["type"] == "PointCloudMessage"])
        seat.session.show_frame(other_frame, Actor.HUMAN)
        expected = services.data.cloud(seat.frames[other_frame]).points
        client.wait_for(
            "PointCloudMessage", lambda m: np.array_equal(m["props"]["points"], expected.reshape(-1))
        )
        assert count <= 1
        seat.session.submit(Actor.HUMAN)
        client.wait_for("SceneNodeUpdateMessage", lambda m: "disable_axes" in m["updates"])
