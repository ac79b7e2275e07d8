"""Simulated operators work through real sessions, in simulated time."""

import time
from datetime import timedelta
from itertools import pairwise

import numpy as np
import pytest
from sqlalchemy import select

from app.analysis.trace.trace import trace_of, until_submission
from app.services import Services
from app.storage.roles import Role
from app.storage.tables import Event, Participant, Registration, Study, Task
from app.study.plan import StudyPlan
from app.study.simulated.simulation import SimulationError, create_simulated, simulate
from app.study.simulated.workplace import Workplace
from app.study.studies import Joined, Studies
from registration_core.geometry import pose

PLAN = {
    "groups": {"novice": 1, "expert": 1},
    "tasks": [{"scene_id": 1, "object_id": 1}],
    "practice": [{"scene_id": 1, "object_id": 2}],
}


@pytest.fixture
def workplace(services: Services) -> Workplace:
    return Workplace(services.database, services.data, services.snapper)


def created(workplace: Workplace, services: Services, name: str = "try", **changes: object) -> Study:
    owner = services.auth.ensure_user("root", Role.ADMIN)
    plan = StudyPlan.model_validate(PLAN | changes)
    return create_simulated(workplace, name, plan, 3, owner.id)


def ignore(done: int, total: int) -> None:
    """Progress."""


def registrations_of(services: Services, study: Study) -> list[tuple[Participant, Registration, Task]]:
    query = (
        select(Participant, Registration, Task)
        .join(Registration, Registration.user_id == Participant.user_id)
        .join(Task, Task.id == Registration.task_id)
        .where(Participant.study_id == study.id)
        .order_by(Registration.id)
    )
    with services.database.read() as session:
        return [(row[0], row[1], row[2]) for row in session.execute(query)]


def events_of(services: Services, study: Study) -> list[list[Event]]:
    return [list(services.log.events(row.id)) for _, row, _ in registrations_of(services, study)]


def errors_of(services: Services, study: Study) -> dict[tuple[str, str], pose.PoseDistance]:
    """How far off each registration ended, by group and mode."""
    return {
        (participant.group, task.mode): pose.distance(
            np.array(registration.T_world_object), np.array(task.T_world_object_reference)
        )
        for participant, registration, task in registrations_of(services, study)
    }


def test_all_of_it_is_done_and_marked(services, workplace):
    study = created(workplace, services)
    told = []
    simulate(workplace, study.id, lambda done, total: told.append((done, total)))
    assert told == [(done, 6) for done in range(1, 7)]
    rows = registrations_of(services, study)
    assert [row.state for _, row, _ in rows] == ["submitted"] * 6
    assert all(one.is_simulated and one.consented_at and one.finished_at for one, _, _ in rows)
    assert study.is_simulated
    for events in events_of(services, study):
        assert {event.boot_id.split("-")[0] for event in events} == {"simulated"}
    assert all(services.replays.recorded(row.id)[1].is_simulated for _, row, _ in rows)


def test_the_log_tells_simulated_seconds(services, workplace):
    study = created(workplace, services)
    began = time.monotonic()
    simulate(workplace, study.id, ignore)
    took = time.monotonic() - began
    logs = events_of(services, study)
    assert sum(log[-1].monotonic_seconds - log[0].monotonic_seconds for log in logs) > took
    for event in (event for log in logs for event in log):
        assert event.utc == study.created_at + timedelta(seconds=event.monotonic_seconds)
    drags = [event for log in logs for event in log if event.kind == "drag"]
    for drag in drags:
        assert drag.path is not None and drag.dof is not None
        seconds = [row[0] for row in drag.path]
        assert seconds[-1] == pytest.approx(drag.duration_seconds, abs=1e-4)
        assert np.allclose(np.diff(seconds)[:-1], 0.05, atol=1e-3)
        assert len(drag.dof) == 1
    for before, after in pairwise(logs[0]):
        reach = after.monotonic_seconds - before.monotonic_seconds - (after.duration_seconds or 0.0)
        assert reach > 2.0  # nobody decides and reaches for a handle more quickly


def test_the_trace_is_that_of_the_simulated_time(services, workplace):
    study = created(workplace, services)
    simulate(workplace, study.id, ignore)
    (_, registration, task), log = registrations_of(services, study)[0], events_of(services, study)[0]
    trace = trace_of(task.T_world_object_start, until_submission(log))
    assert trace.duration == pytest.approx(log[-1].monotonic_seconds - log[0].monotonic_seconds)
    assert not trace.idle
    assert registration.T_world_object is not None
    assert np.allclose(trace.T_world_object, registration.T_world_object)


def test_the_same_seed_does_the_same(services, workplace):
    paths = []
    for name in ("one", "other"):
        study = created(workplace, services, name)
        simulate(workplace, study.id, ignore)
        paths.append([[event.path for event in log] for log in events_of(services, study)])
    assert paths[0] == paths[1]


def test_who_is_careful_is_slower_and_nearer(services, workplace):
    study = created(workplace, services, tasks=[{"scene_id": 1, "object_id": 1}], practice=[])
    simulate(workplace, study.id, ignore)
    ends = errors_of(services, study)
    seconds = {
        (participant.group, task.mode): log[-1].monotonic_seconds - log[0].monotonic_seconds
        for (participant, _, task), log in zip(
            registrations_of(services, study), events_of(services, study), strict=True
        )
    }
    for group in ("novice", "expert"):
        assert seconds[group, "accurate"] > seconds[group, "quick"]
        assert ends[group, "accurate"].translation < 0.02
        assert ends[group, "quick"].translation < 0.05
    assert seconds["novice", "accurate"] > seconds["expert", "accurate"]


def test_who_was_interrupted_goes_on_later_and_the_clock_never_back(services, workplace):
    study = created(workplace, services)

    def interrupt(done: int, total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(workplace, study.id, interrupt)
    assert len(registrations_of(services, study)) == 2
    simulate(workplace, study.id, ignore)
    rows = registrations_of(services, study)
    assert len(rows) == 6 and {row.state for _, row, _ in rows} == {"submitted"}
    for user_id in {one.user_id for one, _, _ in rows}:
        of_user = [event for log in events_of(services, study) for event in log if event.user_id == user_id]
        seconds = [event.monotonic_seconds for event in of_user]
        assert seconds == sorted(seconds)


def test_a_study_whose_setting_up_was_interrupted_is_completed(services, workplace, monkeypatch):
    add = Studies.add_participant
    added: list[Joined] = []

    def interrupt(*given, **more):
        if added:
            raise KeyboardInterrupt
        added.append(add(*given, **more))

    with monkeypatch.context() as patched:
        patched.setattr(Studies, "add_participant", interrupt)
        with pytest.raises(KeyboardInterrupt):
            created(workplace, services)
    with services.database.read() as session:
        study = session.scalars(select(Study)).one()
    simulate(workplace, study.id, ignore)
    rows = registrations_of(services, study)
    assert len(rows) == 6 and {row.state for _, row, _ in rows} == {"submitted"}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"groups": {"robot": 1}}, "of the groups novice and expert, not 'robot'"),
        ({"conditions": ["manual", "snap"]}, "the condition 'snap' needs people"),
        ({"tasks": [{"scene_id": 1, "object_id": 1, "instance": 7}]}, "instance 7 has no reference pose"),
    ],
)
def test_what_cannot_be_simulated_is_said_and_leaves_nothing(services, workplace, changes, message):
    with pytest.raises(SimulationError, match=message):
        created(workplace, services, **changes)
    with services.database.read() as session:
        assert session.scalar(select(Study)) is None
