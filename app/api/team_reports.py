"""The same curves from ordinary work: by operator, object and week."""

from fastapi import APIRouter
from pydantic import BaseModel

from app.analysis.statistics.cells import cells_of
from app.analysis.study_data.trial import TrialTrace
from app.analysis.team.advice import advice_for
from app.analysis.team.team import TEAM_TIMING, TeamRow, Work, team_rows
from app.api.dependencies import Choice, ReviewerDep, ServicesDep
from app.api.problems import InputError
from app.api.report_models import CellOut, RemarkOut, cell_out, number, remarks_out

router = APIRouter(prefix="/api/reports", tags=["reports"])

SEED = 0
"""Of the bootstrap."""


class TeamRowOut(BaseModel):
    """Figures of an operator, object and week; means of a registration."""

    operator: str
    object: str
    week: str
    registrations: int
    active_seconds: float
    snaps: float
    accepted: float | None
    drags_after: float | None


class AdviceOut(BaseModel):
    """At which error an operator should let the machine take over; metres and radians."""

    operator: str
    snaps: int
    translation: float | None
    rotation: float | None
    dragged_on: float | None
    text: str


class TeamOut(BaseModel):
    """Ordinary work, or the part of it that was asked for."""

    choices: dict[str, list[str]]
    rows: list[TeamRowOut]
    advice: list[AdviceOut]
    cells: list[CellOut]
    remarks: list[RemarkOut]


@router.get("/team")
def get_team_report(
    services: ServicesDep,
    _identity: ReviewerDep,
    operator: Choice = None,
    object: Choice = None,
    week: Choice = None,
) -> TeamOut:
    """Curves and figures of ordinary work; each registration's last pose counts as its truth."""
    work, remarks = services.kept.team()
    choices = {name: sorted({_value(one, name) for one in work}) for name in ("operator", "object", "week")}
    for name, value in (("operator", operator), ("object", object), ("week", week)):
        if value is None:
            continue
        if value not in choices[name]:
            there = ", ".join(choices[name]) or "none"
            raise InputError(f"{name} {value!r} is not in any submitted work; there are: {there}.")
        work = [one for one in work if _value(one, name) == value]
    by_operator = {name: [one for one in work if one.trial.operator == name] for name in choices["operator"]}
    return TeamOut(
        choices=choices,
        rows=[_row_out(row) for row in team_rows(work)],
        advice=[_advice_out(name, part) for name, part in by_operator.items() if part],
        cells=[cell_out(cell) for cell in cells_of([one.trial for one in work], TEAM_TIMING, SEED, _unit)],
        remarks=remarks_out(remarks),
    )


def _unit(trial: TrialTrace) -> str:
    """A cell is of one operator here: intervals are over registrations."""
    return str(trial.registration_id)


def _value(work: Work, name: str) -> str:
    return work.week if name == "week" else str(getattr(work.trial, name))


def _row_out(row: TeamRow) -> TeamRowOut:
    return TeamRowOut(
        **{**vars(row), "accepted": number(row.accepted), "drags_after": number(row.drags_after)}
    )


def _advice_out(operator: str, work: list[Work]) -> AdviceOut:
    advice = advice_for(operator, work)
    numbers = {name: number(getattr(advice, name)) for name in ("translation", "rotation", "dragged_on")}
    return AdviceOut(**{**vars(advice), **numbers})
