"""Taking part in a study: what comes next, agreeing, answering, and leaving it."""

from typing import Annotated, cast

from fastapi import APIRouter, Depends, HTTPException
from pydantic import BaseModel, Field

from app.access.auth import Identity
from app.api.dependencies import AnyoneDep, ServicesDep
from app.storage.roles import Role
from app.storage.tables import Condition, Mode
from app.study.participation import Place, ScreenKind, place_of

router = APIRouter(prefix="/api/participation", tags=["studies"])


def participant_only(identity: AnyoneDep) -> Identity:
    """Whoever takes part; 403 for all others."""
    if identity.role is not Role.PARTICIPANT:
        raise HTTPException(403, "You are signed in, but take part in no study: open a participant's link.")
    return identity


ParticipantDep = Annotated[Identity, Depends(participant_only)]


class NextTask(BaseModel):
    """The task that comes next."""

    id: int
    mode: Mode
    condition: Condition
    is_practice: bool
    scene: str
    object: str
    instructions: str


class QuestionOut(BaseModel):
    """What is asked once, before the tasks."""

    text: str
    choices: list[str] = Field(description="None: a short free answer.")
    optional: bool = Field(description="May be left empty.")


class ParticipationOut(BaseModel):
    """Where a participant stands."""

    study: str
    code: str
    is_simulated: bool
    done: int = Field(description="Tasks that count and are submitted.")
    total: int
    screens: list[ScreenKind] = Field(
        description="What is to be shown, in this order, up to the task or the end; "
        "consent and questions stay until they are answered."
    )
    consent: str
    questions: list[QuestionOut]
    task: NextTask | None


class Answers(BaseModel):
    """What a participant answers."""

    answers: dict[str, Annotated[str, Field(max_length=1000)]] = Field(
        max_length=30, description="By the questions' texts; empty or left out where one may be left empty."
    )


@router.get("")
def get_participation(services: ServicesDep, identity: ParticipantDep) -> ParticipationOut:
    """What comes next for me."""
    place = place_of(services.database, identity.user_id)
    if place.trial is None:
        services.studies.finish(place.participant.id)
    return _out(place)


@router.post("/consent")
def consent(services: ServicesDep, identity: ParticipantDep) -> ParticipationOut:
    """I agree to take part."""
    services.studies.consent(place_of(services.database, identity.user_id).participant.id)
    return get_participation(services, identity)


@router.post("/answers")
def answer(body: Answers, services: ServicesDep, identity: ParticipantDep) -> ParticipationOut:
    """My answers to what the study asks."""
    place = place_of(services.database, identity.user_id)
    services.studies.answer(place.participant.id, body.answers)
    return get_participation(services, identity)


@router.post("/withdraw", status_code=204)
def withdraw(services: ServicesDep, identity: ParticipantDep) -> None:
    """I leave the study: my data are left out from now on, and my link is void."""
    services.studies.withdraw(place_of(services.database, identity.user_id).participant.id)
    services.live_sessions.leave(identity.user_id)


def _out(place: Place) -> ParticipationOut:
    study = place.participant.study
    return ParticipationOut(
        study=study.name,
        code=place.participant.code,
        is_simulated=place.participant.is_simulated,
        done=place.done,
        total=place.total,
        screens=list(place.screens),
        consent=place.plan.consent,
        questions=[
            QuestionOut(text=one.text, choices=one.offered, optional=one.optional)
            for one in place.plan.questions
        ],
        task=_next_task(place),
    )


def _next_task(place: Place) -> NextTask | None:
    if place.trial is None:
        return None
    task = place.trial.task
    mode, condition = cast(Mode, task.mode), cast(Condition, task.condition)
    return NextTask(
        id=task.id,
        mode=mode,
        condition=condition,
        is_practice=place.trial.is_practice,
        scene=task.scene.label,
        object=task.object.name,
        instructions=place.plan.instructions.get(mode, ""),
    )
