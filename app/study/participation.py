"""One participant's way through a study: what comes next, and what is theirs to see."""

from dataclasses import dataclass
from typing import Literal

from sqlalchemy import ColumnElement, select
from sqlalchemy.orm import Session, joinedload, selectinload

from app.storage.database import Database
from app.storage.tables import Participant, Registration, Task, Trial
from app.study.plan import StudyError, StudyPlan
from app.study.studies import require_taking_part

ScreenKind = Literal["consent", "questions", "practice", "break", "instructions", "task", "thanks"]


@dataclass(frozen=True)
class Place:
    """Where a participant stands in their study."""

    participant: Participant
    plan: StudyPlan
    trial: Trial | None
    """The one that comes next, or is under way; none at the end."""
    is_begun: bool
    done: int
    """Tasks that count and are submitted, of `total`."""
    total: int
    screens: tuple[ScreenKind, ...]
    """What the participant is to be shown, in this order, before and including the task or the end."""


def place_of(database: Database, user_id: int) -> Place:
    """Where a participant stands.

    Raises:
        StudyError: where the user is no participant, has withdrawn, or their study is closed.
    """
    with database.read() as session:
        participant = _participant(session, user_id)
        rows = session.scalars(select(Registration).where(Registration.user_id == user_id)).all()
    require_taking_part(participant)
    plan = StudyPlan.model_validate(participant.study.plan)
    states = {row.task_id: row.state for row in rows}
    trials = participant.trials
    index = next((i for i, t in enumerate(trials) if states.get(t.task_id) != "submitted"), len(trials))
    counted = [trial for trial in trials if not trial.is_practice]
    done = sum(not trial.is_practice for trial in trials[:index])
    trial = trials[index] if index < len(trials) else None
    is_begun = trial is not None and trial.task_id in states
    return Place(
        participant=participant,
        plan=plan,
        trial=trial,
        is_begun=is_begun,
        done=done,
        total=len(counted),
        screens=_screens(participant, plan, index, is_begun, done),
    )


def require_turn(database: Database, user_id: int, task_id: int) -> None:
    """Raise `StudyError` unless this task is the participant's next, or one that they have begun."""
    place = place_of(database, user_id)
    with database.read() as session:
        begun = session.scalar(select(Registration.id).filter_by(user_id=user_id, task_id=task_id))
    if begun is not None:
        return
    if place.screens[0] in {"consent", "questions"}:
        raise StudyError("the study begins with its first page; go there first")
    if place.trial is None or place.trial.task_id != task_id:
        raise StudyError("this is not your next task; go on from the study's page")


def sees(database: Database, user_id: int, what: ColumnElement[bool]) -> bool:
    """Whether one of the participant's tasks meets a condition on `Task`, such as being in a scene."""
    query = select(Trial.id).join(Trial.participant).join(Trial.task)
    with database.read() as session:
        return session.scalar(query.where(Participant.user_id == user_id, what).limit(1)) is not None


def _participant(session: Session, user_id: int) -> Participant:
    participant = session.scalar(
        select(Participant)
        .where(Participant.user_id == user_id)
        .options(
            joinedload(Participant.study),
            selectinload(Participant.trials).joinedload(Trial.task).joinedload(Task.object),
            selectinload(Participant.trials).joinedload(Trial.task).joinedload(Task.scene),
        )
    )
    if participant is None:
        raise StudyError("you take part in no study; open the link that was given to you")
    return participant


def _screens(
    participant: Participant, plan: StudyPlan, index: int, is_begun: bool, done: int
) -> tuple[ScreenKind, ...]:
    """Of the trial with this index; who has begun it goes straight back to it."""
    trials = participant.trials
    screens: list[ScreenKind] = []
    if plan.consent and participant.consented_at is None:
        screens.append("consent")
    if plan.questions and participant.answers is None:
        screens.append("questions")
    if index == len(trials):
        return (*screens, "thanks")
    trial, before = trials[index], trials[index - 1] if index else None
    if not is_begun:
        if trial.is_practice and before is None:
            screens.append("practice")
        if plan.break_after and done and done % plan.break_after == 0:
            screens.append("break")
        if before is None or before.is_practice != trial.is_practice or _block(before) != _block(trial):
            screens.append("instructions")
    return (*screens, "task")


def _block(trial: Trial) -> tuple[str, str]:
    return trial.task.mode, trial.task.condition
