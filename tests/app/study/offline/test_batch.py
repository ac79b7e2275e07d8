"""Offline snaps of registrations made by hand, on real workers."""

from dataclasses import replace

import numpy as np
import pytest
from sqlalchemy import select

from app.access.auth import Identity
from app.analysis.trace.trace import trace_of, until_submission
from app.datasets.scene_data import camera_of
from app.labeling.live.sessions import LiveSessions
from app.services import Services
from app.storage.event_log import EventLog
from app.storage.registration_rows import whole_registration
from app.storage.roles import Actor, Role
from app.storage.tables import OfflineSnap, utc_now
from app.study.offline.batch import OfflineBatch, OfflineError, Plan, Summary
from app.study.offline.samples import samples_of
from app.study.offline.sampling import Sampling
from app.study.offline.snap_store import SnapStore, StoreError
from app.study.simulated.operator import SimulatedClock
from app.workers.pool import SnapError
from registration_core import ALGORITHM, SnapConfig, snap
from registration_core.config import ParticleFilterConfig
from registration_core.geometry import pose
from tests.app.small_dataset import TOOL, true_pose

STEPS = (0.06, 0.03, 0.015, 0.0)
"""Metres along x from the truth, one after the other."""


class HandMade:
    """Registrations on a clock that the test moves on."""

    def __init__(self, services: Services) -> None:
        self.services = services
        self.clock = SimulatedClock("test", utc_now())
        self.live_sessions = LiveSessions(
            services.database,
            EventLog(services.database, self.clock),
            services.data,
            services.snapper,
            services.standards,
        )

    def register(self, name: str, *poses: np.ndarray, frame_id: int | None = None) -> int:
        """Two seconds at each pose; the frame is changed before the last one."""
        user = self.services.auth.create_user(name, Role.OPERATOR)
        live_session = self.live_sessions.start(1, Identity(user.id, name, Role.OPERATOR, Actor.SCRIPT))
        for T in poses:
            if frame_id is not None and T is poses[-1]:
                live_session.session.show_frame(frame_id, Actor.SCRIPT)
            live_session.session.set_pose(T, Actor.SCRIPT)
            self.clock.advance(2.0)
        live_session.session.submit(Actor.SCRIPT)
        return live_session.registration.id

    def rows(self, registration_id: int) -> list[OfflineSnap]:
        """What is stored of a registration, in the order of time."""
        query = select(OfflineSnap).filter_by(registration_id=registration_id).order_by(OfflineSnap.seconds)
        with self.services.database.read() as session:
            return list(session.scalars(query))

    def run(self, *registration_ids: int) -> Summary:
        """The batch, to its end."""
        return self.batch.run(registration_ids, lambda done, total: None)

    @property
    def batch(self) -> OfflineBatch:
        """A batch that remembers nothing."""
        return OfflineBatch(self.services.database, self.services.data, self.services.snapper)


@pytest.fixture
def made(services: Services) -> HandMade:
    return HandMade(services)


def beside(metres: float) -> np.ndarray:
    return pose.exp([metres, 0, 0, 0, 0, 0]) @ true_pose(TOOL)


def results(rows: list[OfflineSnap]) -> list[tuple[object, ...]]:
    """All but when and how quickly they were computed."""
    return [
        (row.seconds, row.T_world_object_start, row.input_hash, row.seed, row.T_world_object, row.confidence)
        for row in rows
    ]


def test_every_sample_has_its_snap_and_a_pose_that_rests_is_one_input(made):
    registration_id = made.register("ann", *map(beside, STEPS))
    assert made.run(registration_id) == Summary(samples=17, computed=4, failed=0)
    rows = made.rows(registration_id)
    assert [row.seconds for row in rows] == pytest.approx(np.arange(17) / 2)
    assert len({row.input_hash for row in rows}) == 4
    took = {row.input_hash: row.snap_seconds for row in rows}  # one that rests counts once
    assert SnapStore(made.services.database).median_seconds([registration_id]) == np.median([*took.values()])
    events = until_submission(made.services.log.events(registration_id))
    trace = trace_of(np.eye(4).tolist(), events)
    for row in rows:
        assert np.allclose(row.T_world_object_start, trace.motion.at([row.seconds])[0], atol=1e-8)
    error = np.linalg.norm(np.array(rows[-1].T_world_object)[:3, 3] - true_pose(TOOL)[:3, 3])
    assert error < 0.005


def test_a_snap_can_be_repeated_from_what_is_stored(made):
    registration_id = made.register("ann", beside(0.02))
    made.run(registration_id)
    row = made.rows(registration_id)[0]
    registration = whole_registration(made.services.database, registration_id)
    assert registration is not None
    frame, data = registration.task.frame, made.services.data
    T_world_camera = np.array(frame.T_world_camera)
    estimate = snap(
        data.model(registration.task.object),
        data.depth(frame),
        camera_of(frame),
        pose.inverse(T_world_camera) @ np.array(row.T_world_object_start),
        SnapConfig.from_dict(row.config),
        np.random.default_rng(row.seed),
        color=data.aligned_color(frame),
    )
    assert np.array_equal(T_world_camera @ estimate.T_camera_object, row.T_world_object)
    assert (estimate.confidence, estimate.evaluations) == (row.confidence, row.evaluations)


def test_what_others_passed_through_too_is_not_computed_again(made):
    ann = made.register("ann", beside(0.03), beside(0.01))
    bob = made.register("bob", beside(0.02), beside(0.01))
    assert made.run(ann).computed == 2
    assert made.run(ann, bob) == Summary(samples=18, computed=1, failed=0)
    assert made.run(ann, bob).computed == 0
    assert results(made.rows(ann))[-1][1:] == results(made.rows(bob))[-1][1:]


def test_a_batch_that_was_stopped_goes_on_where_it_was(made):
    registration_id = made.register("ann", *(beside(0.001 * turn) for turn in range(40)))

    def stop(done: int, total: int) -> None:
        if done > total / 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        made.batch.run([registration_id], stop)
    before = made.rows(registration_id)
    assert 0 < len(before) < 161
    assert made.run(registration_id).computed == 40 - len({row.input_hash for row in before})
    after = {row.id: row.snap_seconds for row in made.rows(registration_id)}
    assert len(after) == 161 and {row.id: row.snap_seconds for row in before}.items() <= after.items()


def test_a_snap_that_fails_says_why_and_stops_no_other(made):
    away = pose.exp([0, 0, 50.0, 0, 0, 0]) @ true_pose(TOOL)
    registration_id = made.register("ann", beside(0.02), away, beside(0.01))
    assert made.run(registration_id) == Summary(samples=13, computed=3, failed=4)
    rows = made.rows(registration_id)
    failed = [row for row in rows if row.message]
    assert {row.message for row in failed} == {"T_camera_object puts the object wholly outside the image"}
    assert all(row.T_world_object is None and row.confidence is None for row in failed)
    assert len(rows) == 13 and made.run(registration_id).computed == 0


def test_a_snap_looks_at_the_frame_that_was_shown(made):
    first = whole_registration(made.services.database, made.register("ann", beside(0.0)))
    assert first is not None
    task = first.task
    other = next(frame for frame in task.scene.frames if frame.id != task.frame_id)
    registration_id = made.register("bob", beside(0.02), beside(0.02), frame_id=other.id)
    samples = list(samples_of(made.services.database, registration_id, SnapConfig()))
    shown = [sample.view.frame.id for sample in samples]
    assert shown == [task.frame_id] * 4 + [other.id] * 5
    assert len({sample.input_hash for sample in samples}) == 2


def test_workers_that_cannot_be_reached_end_the_batch(made, monkeypatch):
    registration_id = made.register("ann", beside(0.02))

    def request(job, model, on_progress, on_end, priority):
        on_end(SnapError("The workers cannot be reached. Nothing is lost; try again."))
        return lambda: None

    with monkeypatch.context() as patched:
        patched.setattr(made.services.snapper, "request", request)
        with pytest.raises(OfflineError, match="cannot be reached"):
            made.run(registration_id)
    assert not made.rows(registration_id)
    assert made.run(registration_id).computed == 1


def test_a_worker_that_computes_otherwise_ends_the_batch(made, monkeypatch):
    registration_id = made.register("ann", beside(0.02))
    request = made.services.snapper.request

    def otherwise(job, model, on_progress, on_end, priority):
        return request(
            job,
            model,
            on_progress,
            lambda result: on_end(replace(result, algorithm="0123456789ab")),
            priority,
        )

    with monkeypatch.context() as patched:
        patched.setattr(made.services.snapper, "request", otherwise)
        with pytest.raises(OfflineError, match="algorithm 0123456789ab, this program with"):
            made.run(registration_id)
    assert not made.rows(registration_id)
    made.run(registration_id)
    assert {row.algorithm for row in made.rows(registration_id)} == {ALGORITHM}


def test_two_batches_at_once_are_said(made):
    registration_id = made.register("ann", beside(0.02))

    def interfere(done: int, total: int) -> None:
        if done == 0:
            made.run(registration_id)

    with pytest.raises(StoreError, match="Another batch"):
        made.batch.run([registration_id], interfere)


def test_the_papers_filter_has_snaps_of_its_own_from_fewer_poses(made, monkeypatch):
    short = replace(SnapConfig.paper(), particle_filter=ParticleFilterConfig(particles=40, iterations=20))
    monkeypatch.setattr("app.study.offline.batch.config_of", lambda method: short)
    registration_id = made.register("ann", *map(beside, STEPS))
    services = made.services
    plans: list[Plan] = []
    batch = OfflineBatch(services.database, services.data, services.snapper, "paper", Sampling(2.0, 0.02))
    summary = batch.run([registration_id], lambda done, total: None, plans.append)
    assert summary == Summary(samples=4, computed=3, failed=0)
    assert (plans[0].sampled, plans[0].chosen, plans[0].snaps) == (17, 4, 3) and plans[0].seconds > 0
    rows = made.rows(registration_id)
    assert [row.seconds for row in rows] == pytest.approx([0.0, 2.0, 6.0, 8.0])
    assert {(row.method, row.config["method"]) for row in rows} == {("paper", "particle_filter")}
    again = batch.run([registration_id], lambda done, total: None, plans.append)
    assert again == Summary(samples=4, computed=0, failed=0) and plans[1].seconds == 0.0
    monkeypatch.undo()
    assert made.run(registration_id) == Summary(samples=17, computed=4, failed=0)
    assert [row.method for row in made.rows(registration_id)].count("default") == 17


def test_a_longer_batch_says_so_by_what_was_measured(made):
    registration_id = made.register("ann", beside(0.02))
    made.run(registration_id)
    median = SnapStore(made.services.database).median_seconds([registration_id])
    other = made.register("bob", beside(0.04))
    plans: list[Plan] = []
    made.batch.run([registration_id, other], lambda done, total: None, plans.append)
    workers = made.services.snapper.worker_count()
    assert plans[0].seconds == pytest.approx(median / workers)
