"""The registry opens them from the log, keeps them apart by user, and lets go of idle ones."""

import errno
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from sqlalchemy import select

from app.datasets.symmetries import decide
from app.labeling.live.sessions import NotFoundError
from app.labeling.session_state import SessionState
from app.storage.roles import Actor, Role
from app.storage.tables import Object, Participant, Registration, Study, Task, User, utc_now
from registration_core import ObjectModel, SnapConfig, SymmetryAxis
from registration_core.geometry import pose
from tests.app.labeling.live_sessions import shown, sign_up
from tests.app.labeling.viser_client import ViserClient
from tests.app.rest import SLOW_SNAP
from tests.app.small_dataset import TOOL, true_pose
from tests.app.waiting import LONGEST, wait_until


def test_a_registration_begins_at_the_tasks_start_pose(services, live_session, ann):
    task = live_session.registration.task
    assert np.array_equal(shown(live_session), task.T_world_object_start)
    assert live_session.session.snapshot().frame_id == task.frame_id
    assert [event.kind for event in services.log.events(live_session.registration.id)] == ["opened"]
    assert services.live_sessions.start(1, ann) is live_session
    assert [event.kind for event in services.log.events(live_session.registration.id)] == ["opened", "opened"]


def test_an_unknown_task_is_said(services, ann):
    with pytest.raises(NotFoundError, match="no task 999"):
        services.live_sessions.start(999, ann)


def test_each_user_has_a_registration_of_their_own(services, live_session, ann):
    bob = sign_up(services, "bob")
    his = services.live_sessions.start(1, bob)
    assert his.registration.id != live_session.registration.id
    live_session.session.set_pose(true_pose(TOOL), Actor.HUMAN)
    assert not his.session.snapshot().can_undo
    for stranger, seat_of_other in ((ann, his), (bob, live_session)):
        with pytest.raises(NotFoundError, match="of yours"):
            services.live_sessions.open(seat_of_other.registration.id, stranger)
    services.live_sessions.close_idle(0.0)
    with pytest.raises(NotFoundError, match="of yours"):
        services.live_sessions.open(live_session.registration.id, bob)


def test_nobody_waits_while_the_mesh_of_another_is_read(services, live_session, ann, monkeypatch):
    asked, may_come = threading.Event(), threading.Event()
    read = ObjectModel.from_bytes

    def slow(*arguments):
        asked.set()
        assert may_come.wait(LONGEST)
        return read(*arguments)

    monkeypatch.setattr(ObjectModel, "from_bytes", slow)
    with services.database.read() as session:
        mine = live_session.registration.task.object_id
        task_id = session.scalars(select(Task.id).where(Task.object_id != mine)).first()
    with ThreadPoolExecutor(2) as pool:
        opening = pool.submit(services.live_sessions.start, task_id, sign_up(services, "bob"))
        try:
            assert asked.wait(LONGEST)
            assert pool.submit(services.live_sessions.start, 1, ann).result(LONGEST) is live_session
        finally:
            may_come.set()
        assert opening.result(LONGEST).registration.task_id == task_id


def test_the_log_may_be_read_by_its_owner_and_by_reviewers(services, live_session, ann):
    registration_id = live_session.registration.id
    services.live_sessions.check_readable(registration_id, ann)
    services.live_sessions.check_readable(registration_id, sign_up(services, "rita", Role.REVIEWER))
    with pytest.raises(NotFoundError):
        services.live_sessions.check_readable(registration_id, sign_up(services, "bob"))
    with pytest.raises(NotFoundError):
        services.live_sessions.check_readable(999, ann)


def test_a_closed_session_is_gone_on_with_from_its_log(services, live_session, ann):
    session, start = live_session.session, shown(live_session)
    first, second = true_pose(TOOL), true_pose(TOOL) @ pose.exp([0.01, 0, 0, 0, 0, 0])
    other_frame = next(
        frame_id for frame_id in live_session.frames if frame_id != live_session.registration.task.frame_id
    )
    session.set_pose(first, Actor.HUMAN)
    session.set_pose(second, Actor.HUMAN)
    session.show_frame(other_frame, Actor.HUMAN)
    session.undo(Actor.HUMAN)
    assert services.live_sessions.close_idle(0.0) == 1
    again = services.live_sessions.open(live_session.registration.id, ann)
    assert again is not live_session
    state = again.session.snapshot()
    assert np.array_equal(state.T_world_object, first)
    assert state.can_undo and state.can_redo and state.frame_id == other_frame
    again.session.redo(Actor.HUMAN)
    assert np.array_equal(shown(again), second)
    again.session.undo(Actor.HUMAN)
    again.session.undo(Actor.HUMAN)
    assert np.array_equal(shown(again), start)


def test_a_submitted_registration_stays_so(services, live_session, ann):
    live_session.session.set_pose(true_pose(TOOL), Actor.HUMAN)
    live_session.session.submit(Actor.HUMAN)
    services.live_sessions.close_idle(0.0)
    again = services.live_sessions.start(1, ann)
    assert again.session.snapshot().state == "submitted"
    assert np.array_equal(shown(again), true_pose(TOOL))


def test_what_is_watched_or_was_used_lately_is_not_idle(services, live_session):
    assert services.live_sessions.close_idle(3600.0) == 0
    leave = services.live_sessions.watch(live_session)
    assert services.live_sessions.close_idle(0.0) == 0
    leave()
    assert services.live_sessions.close_idle(0.0) == 1
    assert services.live_sessions.close_idle(0.0) == 0


def test_closing_a_session_cancels_its_snap(services, live_session, ann):
    snap_id = live_session.session.snap(Actor.HUMAN, SnapConfig.from_dict(SLOW_SNAP))
    wait_until(lambda: live_session.session.snapshot().snap.progress > 0, "the snap to run")
    live = services.live_sessions.live_state(live_session.registration.id).snap
    assert live.id == snap_id and live.is_live
    services.live_sessions.close_idle(0.0)
    assert services.live_sessions.live_state(live_session.registration.id) is None
    assert services.log.snap_events(snap_id)[-1].kind == "snap_cancelled"


def test_the_view_is_made_once_and_goes_with_the_session(services, live_session, ann):
    path = services.live_sessions.view_socket(live_session)
    assert services.live_sessions.view_socket(live_session) == path
    with ViserClient(path) as client:
        cloud = client.node("PointCloudMessage", "/cloud")["props"]["points"].reshape(-1, 3)
        expected = services.data.cloud(live_session.frames[live_session.session.snapshot().frame_id])
        assert np.array_equal(cloud, expected.points)
    services.live_sessions.close_idle(0.0)
    with pytest.raises(FileNotFoundError):
        ViserClient(path)
    again = services.live_sessions.open(live_session.registration.id, ann)
    with ViserClient(services.live_sessions.view_socket(again)) as client:
        client.node("MeshMessage", "/object/mesh")


def test_sessions_of_an_object_go_on_with_symmetries_that_are_decided_meanwhile(services, live_session, ann):
    other = services.live_sessions.start(2, ann)
    told: list[SessionState] = []
    live_session.session.subscribe(told.append)
    T_turned = shown(live_session) @ pose.exp([0, 0, 0, 0, 0, np.pi])
    before = live_session.model
    assert not live_session.object.same_pose(shown(live_session), T_turned)
    with services.database.write() as session:
        row = session.get_one(Object, live_session.registration.task.object_id)
        decide(session, row, [SymmetryAxis(np.array([0.0, 0, 1]), np.zeros(3), 2)], before, ann.user_id, 1)
    services.live_sessions.renew_object(row.id)
    assert len(told) == 1
    assert (
        live_session.object.present.symmetries_version == 2
        and len(live_session.model.symmetry_transforms) == 2
    )
    assert live_session.object.same_pose(shown(live_session), T_turned)
    assert other.object.present.symmetries_version == 1
    services.live_sessions.close_idle(0.0)
    assert (
        services.live_sessions.open(live_session.registration.id, ann).object.present.symmetries_version == 2
    )


def test_sessions_close_also_where_that_cannot_be_written_down(services, live_session, ann, monkeypatch):
    def refuse(*_arguments: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    other = services.live_sessions.start(2, sign_up(services, "bob"))
    snap_ids = [
        one.session.snap(Actor.HUMAN, SnapConfig.from_dict(SLOW_SNAP)) for one in (live_session, other)
    ]
    with monkeypatch.context() as full:
        full.setattr(services.log, "append", refuse)
        assert services.live_sessions.close_idle(0.0) == 2
    again = services.live_sessions.open(live_session.registration.id, ann)
    assert again is not live_session
    again.session.set_pose(true_pose(TOOL), Actor.HUMAN)
    wait_until(lambda: not any(map(services.snapper.standing, snap_ids)), "the workers to be given up")
    kinds = [event.kind for event in services.log.events(live_session.registration.id)]
    assert kinds == ["opened", "snap_requested", "set_pose"]


def test_a_request_on_its_way_begins_nothing_for_who_has_withdrawn(services):
    ann = sign_up(services, "ann")
    with services.database.write() as session:
        chief = User(name="chief", role="admin")
        session.add(chief)
        session.flush()
        study = Study(name="s", plan={}, seed=1, user_id=chief.id)
        session.add(study)
        session.flush()
        session.add(
            Participant(
                study_id=study.id, user_id=ann.user_id, code="P01", group="g", row=0, withdrawn_at=utc_now()
            )
        )
    with pytest.raises(NotFoundError, match="withdrawn"):
        services.live_sessions.start(1, ann)
    with services.database.read() as session:
        assert session.scalars(select(Registration.id).filter_by(user_id=ann.user_id)).all() == []
