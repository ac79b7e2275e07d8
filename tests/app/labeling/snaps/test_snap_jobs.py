"""A session's orders, done by real workers on real depth."""

from collections.abc import Callable

import numpy as np

from app.datasets.scene_data import camera_of
from app.storage.roles import Actor
from app.workers.jobs import SnapJob
from registration_core import SnapConfig
from registration_core.geometry import pose
from registration_core.geometry.pose_error import adi
from registration_core.search.snap_input import region_of_interest
from tests.app.labeling.live_sessions import shown, wait_for_snap
from tests.app.small_dataset import TOOL, true_pose


def test_a_snap_finds_the_object_from_nearby(services, live_session):
    near = pose.perturbed(true_pose(TOOL), 0.012, np.radians(10), np.random.default_rng(3))
    live_session.session.set_pose(near, Actor.HUMAN)
    snap_id = live_session.session.snap(Actor.HUMAN, seed=7)
    assert wait_for_snap(live_session) == "done"
    vertices = live_session.model.vertices
    assert adi(shown(live_session), true_pose(TOOL), vertices) < 0.003 < adi(near, true_pose(TOOL), vertices)
    estimate = services.log.estimate(snap_id)
    assert estimate is not None and estimate.seed == 7
    assert np.allclose(estimate.T_world_object, shown(live_session))
    T_world_camera = np.array(live_session.frames[estimate.frame_id].T_world_camera)
    assert np.allclose(T_world_camera @ estimate.T_camera_object, shown(live_session))
    assert SnapConfig.from_dict(estimate.config) == SnapConfig()


def test_every_frame_of_a_scene_gives_the_same_pose(services, live_session):
    found = []
    for frame_id in live_session.frames:
        live_session.session.set_pose(true_pose(TOOL) @ pose.exp([0.008, 0, 0, 0, 0, 0]), Actor.HUMAN)
        live_session.session.show_frame(frame_id, Actor.HUMAN)
        live_session.session.snap(Actor.HUMAN, seed=1, frames="current")
        assert wait_for_snap(live_session) == "done"
        found.append(shown(live_session))
    assert len(found) == 2
    assert all(adi(T, true_pose(TOOL), live_session.model.vertices) < 0.003 for T in found)


def test_colours_go_with_the_frames_that_are_searched(services, live_session, monkeypatch):
    jobs = []

    def keep(job: SnapJob, *_: object) -> Callable[[], None]:
        jobs.append(job)
        return lambda: None

    monkeypatch.setattr(services.snapper, "request", keep)
    live_session.session.set_pose(true_pose(TOOL), Actor.HUMAN)
    live_session.session.snap(Actor.HUMAN, frames="current")
    (job,) = jobs
    searched, asked = job.views
    assert job.used == 1 and asked.color is None
    frame = live_session.frames[live_session.session.snapshot().frame_id]
    whole, camera = services.data.aligned_color(frame), camera_of(frame)
    left, top, width, height = region_of_interest(live_session.model, camera, job.T_camera_object, job.config)
    np.testing.assert_array_equal(searched.color, whole[top : top + height, left : left + width])


def test_a_snap_out_of_view_fails_with_a_sentence(services, live_session):
    live_session.session.set_pose(true_pose(TOOL) @ pose.exp([50.0, 0, 0, 0, 0, 0]), Actor.HUMAN)
    snap_id = live_session.session.snap(Actor.HUMAN)
    assert wait_for_snap(live_session) == "failed"
    message = live_session.session.snapshot().snap.message
    assert "outside the image" in message and message.endswith(".") and not message.endswith("..")
    assert [event.kind for event in services.log.snap_events(snap_id)] == ["snap_requested", "snap_failed"]
