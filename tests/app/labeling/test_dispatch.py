"""A session's orders, done by real workers on real depth."""

import numpy as np

from app.auth import Actor
from app.scene_data import camera_of
from registration_core import SnapConfig, pose
from registration_core.pose_error import adi
from registration_core.problem import region_of_interest
from tests.app.labeling.seats import shown, wait_for_snap
from tests.app.small_dataset import TOOL, true_pose


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
        seat.session.snap(Actor.HUMAN, seed=1, frames="current")
        assert wait_for_snap(seat) == "done"
        found.append(shown(seat))
    assert len(found) == 2
    assert all(adi(T, true_pose(TOOL), seat.model.vertices) < 0.003 for T in found)


def test_colours_go_with_the_frames_that_are_searched(services, seat, monkeypatch):
    jobs = []
    monkeypatch.setattr(services.snapper, "request", lambda job, *_: jobs.append(job) or (lambda: None))
    seat.session.set_pose(true_pose(TOOL), Actor.HUMAN)
    seat.session.snap(Actor.HUMAN, frames="current")
    (job,) = jobs
    searched, asked = job.views
    assert job.used == 1 and asked.color is None
    frame = seat.frames[seat.session.snapshot().frame_id]
    whole, camera = services.data.aligned_color(frame), camera_of(frame)
    left, top, width, height = region_of_interest(seat.model, camera, job.T_camera_object, job.config)
    np.testing.assert_array_equal(searched.color, whole[top : top + height, left : left + width])


def test_a_snap_out_of_view_fails_with_a_sentence(services, seat):
    seat.session.set_pose(true_pose(TOOL) @ pose.exp([50.0, 0, 0, 0, 0, 0]), Actor.HUMAN)
    snap_id = seat.session.snap(Actor.HUMAN)
    assert wait_for_snap(seat) == "failed"
    message = seat.session.snapshot().snap.message
    assert "outside the image" in message and message.endswith(".") and not message.endswith("..")
    assert [event.kind for event in services.log.snap_events(snap_id)] == ["snap_requested", "snap_failed"]
