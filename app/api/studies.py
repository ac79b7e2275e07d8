"""Studies, for those who run them: setting one up, its order, its participants, their progress and links."""

import secrets
from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, HTTPException, Request, Response
from pydantic import BaseModel, Field
from sqlalchemy import select

from app.api.dependencies import AdminDep, AfterDep, Id, LimitDep, Page, ServicesDep, page_of, row_or_404
from app.services import Services
from app.storage.tables import Condition, Mode, Participant, Study
from app.study.answers import answers_csv
from app.study.plan import (
    MINUTES_A_TASK,
    GroupName,
    Line,
    StudyPlan,
    TaskRef,
    expected_minutes,
    order_of,
    rows_of_balance,
)
from app.study.studies import Standing

router = APIRouter(prefix="/api/studies", tags=["studies"])

MOST_PREVIEWED = 24
"""Rows of a preview; the ones that follow are made in the same way."""

Seed = Annotated[int, Field(ge=0, lt=2**63)]


class PlanAndSeed(BaseModel):
    """All that the order hangs on."""

    plan: StudyPlan
    seed: Seed


class NewStudy(BaseModel):
    """A study to set up."""

    name: Line
    plan: StudyPlan
    seed: Seed | None = Field(None, description="Left out, one is drawn; it is told and kept.")


class SlotOut(BaseModel):
    """One task in an operator's order."""

    task: TaskRef
    mode: Mode
    condition: Condition
    is_practice: bool


class PreviewOut(BaseModel):
    """In which order operators would do what."""

    rows_of_balance: int = Field(description="Operators that a group needs for each block in each place.")
    minutes: float = Field(description="Of one operator, practice included, breaks not; an assumption.")
    minutes_a_task: dict[Mode, float] = Field(description="Which that assumes.")
    orders: list[list[SlotOut]] = Field(
        description="Of the rows that groups begin with, the first operator of each in the first."
    )


class StudyOut(BaseModel):
    """A study."""

    id: int
    name: str
    seed: int
    state: str = Field(description="open or closed")
    is_simulated: bool
    created_at: datetime
    plan: StudyPlan


class ParticipantOut(BaseModel):
    """Somebody who takes part, and how far they are."""

    id: int
    code: str
    group: str
    row: int = Field(description="Of the order, from 0.")
    is_simulated: bool
    done: int
    total: int = Field(description="0 where the data were erased.")
    consented_at: datetime | None
    finished_at: datetime | None
    withdrawn_at: datetime | None
    answers: dict[str, str | None] | None = Field(
        description="By the questions' texts, null for one that was left empty; null before they are given."
    )


class StudyDetail(StudyOut):
    """A study with its participants."""

    participants: list[ParticipantOut]


class NewParticipant(BaseModel):
    """Somebody who is to take part."""

    group: GroupName


class InvitedOut(BaseModel):
    """A participant's link; it is told only once, and can be used again and again."""

    id: int
    code: str
    link: str


@router.post("/preview")
def preview(body: PlanAndSeed, services: ServicesDep, _identity: AdminDep) -> PreviewOut:
    """The order that a plan leads to, before anything is kept."""
    services.studies.check(body.plan)
    rows = min(max(body.plan.groups.values()), MOST_PREVIEWED)
    orders = [
        [
            SlotOut(task=slot.task, mode=slot.mode, condition=slot.condition, is_practice=slot.is_practice)
            for slot in order_of(body.plan, row, body.seed)
        ]
        for row in range(rows)
    ]
    return PreviewOut(
        rows_of_balance=rows_of_balance(body.plan),
        minutes=expected_minutes(body.plan),
        minutes_a_task=dict(MINUTES_A_TASK),
        orders=orders,
    )


@router.post("", status_code=201)
def create_study(body: NewStudy, services: ServicesDep, identity: AdminDep) -> StudyOut:
    """Set up a study, with the tasks that it needs."""
    seed = secrets.randbelow(2**31) if body.seed is None else body.seed
    return _out(services.studies.create(body.name, body.plan, seed, identity.user_id))


@router.get("")
def list_studies(
    services: ServicesDep, _identity: AdminDep, after: AfterDep = 0, limit: LimitDep = 100
) -> Page[StudyOut]:
    """All studies."""
    with services.database.read() as session:
        return page_of(session, select(Study), Study.id, after, limit, _out)


@router.get("/{study_id}")
def get_study(study_id: Id, services: ServicesDep, _identity: AdminDep) -> StudyDetail:
    """One study, and how far its participants are."""
    study = _study(services, study_id)
    participants = [_participant_out(standing) for standing in services.studies.progress(study_id)]
    return StudyDetail(**_out(study).model_dump(), participants=participants)


@router.get(
    "/{study_id}/answers.csv", response_class=Response, responses={200: {"content": {"text/csv": {}}}}
)
def get_answers(study_id: Id, services: ServicesDep, _identity: AdminDep) -> Response:
    """What participants answered: a row an answer, with whether it was left empty or declined."""
    _study(services, study_id)
    return Response(
        answers_csv(services.database, study_id),
        media_type="text/csv; charset=utf-8",
        headers={"content-disposition": f'attachment; filename="study-{study_id}-answers.csv"'},
    )


@router.post("/{study_id}/close")
def close_study(study_id: Id, services: ServicesDep, _identity: AdminDep) -> StudyDetail:
    """End a study: nobody joins it or goes on with it any more; its data stay."""
    study = _study(services, study_id)
    services.studies.close(study_id)
    for standing in services.studies.progress(study.id):
        services.live_sessions.leave(standing.participant.user_id)
    return get_study(study_id, services, _identity)


@router.post("/{study_id}/participants", status_code=201)
def add_participant(
    study_id: Id, body: NewParticipant, request: Request, services: ServicesDep, _identity: AdminDep
) -> InvitedOut:
    """Invite one more operator into a group."""
    _study(services, study_id)
    joined = services.studies.add_participant(study_id, body.group)
    return _invited(joined.participant, joined.secret, request, services)


@router.post("/{study_id}/participants/{participant_id}/link")
def renew_link(
    study_id: Id, participant_id: Id, request: Request, services: ServicesDep, _identity: AdminDep
) -> InvitedOut:
    """A new link for a participant; the one before is void."""
    participant = _participant(services, study_id, participant_id)
    return _invited(participant, services.studies.new_secret(participant_id), request, services)


@router.post("/{study_id}/participants/{participant_id}/withdraw", status_code=204)
def withdraw_participant(
    study_id: Id, participant_id: Id, services: ServicesDep, _identity: AdminDep
) -> None:
    """Take a participant out, as they asked for: their data are left out, their link is void."""
    participant = _participant(services, study_id, participant_id)
    services.studies.withdraw(participant_id)
    services.live_sessions.leave(participant.user_id)


@router.delete("/{study_id}/participants/{participant_id}", status_code=204)
def erase_participant(study_id: Id, participant_id: Id, services: ServicesDep, _identity: AdminDep) -> None:
    """Erase all that a participant did and answered, for good; that they were there stays."""
    participant = _participant(services, study_id, participant_id)
    services.studies.withdraw(participant_id)
    services.live_sessions.leave(participant.user_id)  # before erasing: closing a session may still write
    services.studies.erase(participant_id)
    services.live_sessions.leave(participant.user_id)  # one that a request on its way had opened again


def _study(services: Services, study_id: int) -> Study:
    with services.database.read() as session:
        return row_or_404(session, Study, study_id)


def _participant(services: Services, study_id: int, participant_id: int) -> Participant:
    with services.database.read() as session:
        participant = row_or_404(session, Participant, participant_id)
    if participant.study_id != study_id:
        raise HTTPException(404, f"There is no participant {participant_id} of study {study_id}.")
    return participant


def _invited(participant: Participant, secret: str, request: Request, services: Services) -> InvitedOut:
    base = services.settings.public_url or str(request.base_url)
    # behind the # it stays out of every server's log
    link = f"{base.rstrip('/')}/participate#{secret}"
    return InvitedOut(id=participant.id, code=participant.code, link=link)


def _out(row: Study) -> StudyOut:
    return StudyOut(**{name: getattr(row, name) for name in StudyOut.model_fields})


def _participant_out(standing: Standing) -> ParticipantOut:
    row = standing.participant
    names = ParticipantOut.model_fields.keys() - {"done", "total"}
    return ParticipantOut(
        **{name: getattr(row, name) for name in names}, done=standing.done, total=standing.total
    )
