"""Studies with simulated operators, for tests and demonstrations only.

Whatever they do is marked: the study and its participants are simulated, and their events come from a run of
the server that is named so (`SimulatedClock.boot_id`).
"""

from collections import Counter, defaultdict
from collections.abc import Callable
from itertools import chain, islice, zip_longest
from typing import cast

import numpy as np
from sqlalchemy import func, select
from sqlalchemy.orm import joinedload

from app.access.auth import Identity
from app.confidence.standards import Standards
from app.labeling.live.sessions import LiveSessions
from app.storage.database import Database
from app.storage.event_log import EventLog
from app.storage.roles import Actor, Role
from app.storage.tables import Event, Mode, Participant, Registration, Study, Task, Trial
from app.study.plan import StudyPlan
from app.study.simulated.operator import CARES, MOTOR_MODELS, SimulatedClock, SimulatedOperator
from app.study.simulated.workplace import Workplace

BY_HAND = "manual"


class SimulationError(Exception):
    """A study cannot be simulated; the message says why and may be shown."""


def plan_of(database: Database, operators: int, scenes: int) -> StudyPlan:
    """A plan for so many novices, as many experts, and an object of known pose in each of so many scenes.

    The scenes are of all datasets in turn; objects that were chosen before are so again only where a scene
    has no other one.

    Raises:
        SimulationError: where there are too few such scenes.
    """
    query = (
        select(Task)
        .where(Task.T_world_object_reference.is_not(None))
        .order_by(Task.scene_id, Task.object_id, Task.instance)
        .options(joinedload(Task.scene))
    )
    datasets: dict[int, dict[int, list[Task]]] = defaultdict(lambda: defaultdict(list))
    with database.read() as session:
        for task in session.scalars(query):
            datasets[task.scene.dataset_id][task.scene_id].append(task)
    in_turn = chain.from_iterable(zip_longest(*(by_scene.values() for by_scene in datasets.values())))
    chosen: list[Task] = []
    for tasks in islice(filter(None, in_turn), scenes):
        before = {task.object_id for task in chosen}
        chosen.append(next((task for task in tasks if task.object_id not in before), tasks[0]))
    if len(chosen) < scenes:
        raise SimulationError(
            f"{scenes} scenes with an object of known pose are needed; there are {len(chosen)}"
        )
    tasks = [{"scene_id": t.scene_id, "object_id": t.object_id, "instance": t.instance} for t in chosen]
    return StudyPlan.model_validate({"groups": dict.fromkeys(MOTOR_MODELS, operators), "tasks": tasks})


def create_simulated(workplace: Workplace, name: str, plan: StudyPlan, seed: int, user_id: int) -> Study:
    """Add a study whose groups are complete, with simulated operators who have not begun yet.

    Raises:
        SimulationError: where its operators could not do what it asks for.
        StudyError: where the study cannot be made.
    """
    _check(workplace, plan)
    study = workplace.studies.create(name, plan, seed, user_id, is_simulated=True)
    _complete(workplace, study.id)
    return study


def simulate(workplace: Workplace, study_id: int, on_progress: Callable[[int, int], None]) -> None:
    """Let all simulated participants of a study do what they have not done yet, one after the other.

    Args:
        workplace: Where the study is.
        study_id: Whose participants.
        on_progress: Told how many trials are done, and of how many.
    """
    _complete(workplace, study_id)
    participants = _participants(workplace.database, study_id)
    done, total = 0, sum(len(participant.trials) for participant in participants)
    for number, participant in enumerate(participants):
        workplace.studies.consent(participant.id)
        clock = _clock_of(workplace.database, participant)
        log = EventLog(workplace.database, clock)
        standards = Standards(workplace.database)
        live_sessions = LiveSessions(workplace.database, log, workplace.data, workplace.snapper, standards)
        try:
            for trial in participant.trials:
                rng = np.random.default_rng([participant.study.seed, number, trial.place])
                if _is_to_do(workplace.database, participant, trial):
                    _do(live_sessions, clock, participant, trial, rng)
                done += 1
                on_progress(done, total)
        finally:
            live_sessions.close()
        workplace.studies.finish(participant.id)


def _complete(workplace: Workplace, study_id: int) -> None:
    """Add whoever is missing in the groups: setting up a study may have been interrupted, too."""
    with workplace.database.read() as session:
        groups = session.get_one(Study, study_id).plan["groups"]
        there = Counter(session.scalars(select(Participant.group).where(Participant.study_id == study_id)))
    for group, count in groups.items():
        for _ in range(count - there[group]):
            workplace.studies.add_participant(study_id, group, is_simulated=True)


def _check(workplace: Workplace, plan: StudyPlan) -> None:
    workplace.studies.check(plan)
    for group in plan.groups:
        if group not in MOTOR_MODELS:
            raise SimulationError(
                f"simulated operators are of the groups {' and '.join(MOTOR_MODELS)}, not {group!r}"
            )
    for condition in plan.conditions:
        if condition != BY_HAND:
            raise SimulationError(
                f"simulated operators work by hand alone: the condition {condition!r} needs people"
            )
    for ref in [*plan.practice, *plan.tasks]:
        with workplace.database.read() as session:
            query = select(Task).filter_by(**ref.model_dump()).order_by(Task.id).limit(1)
            task = session.scalar(query)
        if task is None or task.T_world_object_reference is None:
            raise SimulationError(
                f"{ref} has no reference pose: simulated operators would not know where the object belongs"
            )


def _participants(database: Database, study_id: int) -> list[Participant]:
    query = (
        select(Participant)
        .where(Participant.study_id == study_id, Participant.is_simulated, Participant.withdrawn_at.is_(None))
        .order_by(Participant.id)
        .options(joinedload(Participant.study), joinedload(Participant.trials).joinedload(Trial.task))
    )
    with database.read() as session:
        return list(session.scalars(query).unique())


def _clock_of(database: Database, participant: Participant) -> SimulatedClock:
    """It goes on where it stood when the simulation was interrupted; all participants begin at once."""
    last = select(func.max(Event.monotonic_seconds)).where(Event.user_id == participant.user_id)
    with database.read() as session:
        seconds = session.scalar(last) or 0.0
    name = f"{participant.study_id}-{participant.id}"
    return SimulatedClock(name, participant.study.created_at, seconds)


def _is_to_do(database: Database, participant: Participant, trial: Trial) -> bool:
    state = select(Registration.state).filter_by(task_id=trial.task_id, user_id=participant.user_id)
    with database.read() as session:
        return session.scalar(state) in (None, "open")


def _do(
    live_sessions: LiveSessions,
    clock: SimulatedClock,
    participant: Participant,
    trial: Trial,
    rng: np.random.Generator,
) -> None:
    identity = Identity(participant.user_id, participant.code, Role.PARTICIPANT, Actor.SCRIPT)
    live_session = live_sessions.start(trial.task_id, identity)
    T_world_object = np.array(trial.task.T_world_object_reference)
    care = CARES[cast(Mode, trial.task.mode)]
    operator = SimulatedOperator(MOTOR_MODELS[participant.group], care, clock, rng)
    operator.register(
        live_session.session,
        live_session.model.centre,
        T_world_object @ live_session.model.symmetry_transforms,
    )
