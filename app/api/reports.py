"""Reports of studies: curves as JSON, and the files of figure, tables and page."""

from dataclasses import dataclass
from typing import Annotated

from fastapi import APIRouter, Depends, HTTPException, Query, Response
from pydantic import BaseModel, Field

from app.analysis.report.report import Report, ReportConfig, report_of
from app.analysis.statistics.curves import PAPER_SECONDS, SNAP_SECONDS
from app.analysis.study_data.collect import TruthSource
from app.analysis.study_data.selection import Selection, choices_of
from app.analysis.study_data.trial import ErrorKind
from app.api.dependencies import Choice, Id, ReviewerDep, ServicesDep
from app.api.problems import InputError
from app.api.report_models import (
    CellOut,
    ComparisonOut,
    GainOut,
    RemarkOut,
    cell_out,
    comparison_out,
    gain_out,
    number,
    remarks_out,
)

router = APIRouter(prefix="/api/reports", tags=["reports"])

MEDIA_TYPES = {
    "svg": "image/svg+xml",
    "pdf": "application/pdf",
    "html": "text/html; charset=utf-8",
    "csv": "text/csv; charset=utf-8",
    "parquet": "application/vnd.apache.parquet",
}


class ConfigOut(BaseModel):
    """How the report was computed."""

    snap_seconds: float
    without_idle: bool
    truth: TruthSource
    seed: int
    paper_seconds: float


class TruthOut(BaseModel):
    """The ground truth of one object in one scene; metres and radians."""

    name: str
    registrations: int
    translation_spread: float | None
    rotation_spread: float | None
    from_reference: tuple[float, float] | None


class ReportOut(BaseModel):
    """A study, or the part of it that was asked for."""

    study_id: int
    name: str
    is_simulated: bool
    choices: dict[str, list[str]]
    groups: dict[str, int]
    config: ConfigOut
    algorithm: str | None = Field(
        description="That of the offline snaps; null where there are none, or an older version did not say."
    )
    trials: int
    cells: list[CellOut]
    gains: list[GainOut]
    comparisons: list[ComparisonOut]
    truths: list[TruthOut]
    remarks: list[RemarkOut]
    tables: list[str] = Field(description="each a file NAME.csv and a file NAME.parquet")


def asked_config(
    snap_seconds: Annotated[
        float, Query(ge=0, le=60, description="charged for each offline snap")
    ] = SNAP_SECONDS,
    without_idle: Annotated[bool, Query(description="leave idle time out")] = False,
    truth: Annotated[TruthSource, Query(description="what errors are measured from")] = "operators",
    seed: Annotated[int, Query(ge=0, le=2**31 - 1, description="of the bootstrap")] = 0,
    paper_seconds: Annotated[
        float, Query(ge=0, le=60, description="charged for each offline snap by the paper's filter")
    ] = PAPER_SECONDS,
) -> ReportConfig:
    """How the report is to be computed."""
    return ReportConfig(snap_seconds, without_idle, truth, seed, paper_seconds)


def asked_selection(
    group: Choice = None,
    mode: Choice = None,
    condition: Choice = None,
    scene: Choice = None,
    object: Choice = None,
) -> Selection:
    """Which part of the study is asked for."""
    return Selection(group, mode, condition, scene, object)


@dataclass(frozen=True, eq=False)
class Asked:
    """A report, and what else could have been chosen."""

    report: Report
    choices: dict[str, list[str]]


def asked_report(
    study_id: Id,
    services: ServicesDep,
    _identity: ReviewerDep,
    config: Annotated[ReportConfig, Depends(asked_config)],
    selection: Annotated[Selection, Depends(asked_selection)],
) -> Asked:
    """The report of a study, or of a part of it."""
    try:
        collected = services.kept.study(study_id, config.truth)
        return Asked(report_of(selection.of(collected), config), choices_of(collected))
    except LookupError as error:
        raise HTTPException(404, str(error)) from error
    except ValueError as error:
        raise InputError(f"{error}.") from error


AskedDep = Annotated[Asked, Depends(asked_report)]


@router.get("/{study_id}")
def get_report(asked: AskedDep, error: ErrorKind | None = None) -> ReportOut:
    """The curves of a study and all that is read off them, or of a part of it; of one error or of both."""
    from app.analysis.report.tables.registry import tables

    report = asked.report
    collected = report.collected
    return ReportOut(
        study_id=collected.study_id,
        name=collected.name,
        is_simulated=collected.is_simulated,
        choices=asked.choices,
        groups=dict(collected.groups),
        config=ConfigOut(**vars(report.config)),
        algorithm=collected.algorithm,
        trials=len(collected.trials),
        cells=[cell_out(cell) for cell in report.cells if error in (None, cell.error)],
        gains=[gain_out(gain) for gain in report.gains if error in (None, gain.error)],
        comparisons=[comparison_out(pair) for pair in report.comparisons],
        truths=[
            TruthOut(
                name=place.name,
                registrations=place.truth.count,
                translation_spread=number(place.truth.translation_spread),
                rotation_spread=number(place.truth.rotation_spread),
                from_reference=None
                if place.from_reference is None
                else (float(place.from_reference.translation[0]), float(place.from_reference.rotation[0])),
            )
            for place in collected.truths
        ],
        remarks=remarks_out(report.remarks),
        tables=list(tables()),
    )


@router.get(
    "/{study_id}/files/{name}",
    response_class=Response,
    responses={200: {"content": {kind.split(";")[0]: {} for kind in MEDIA_TYPES.values()}}},
)
def get_file(name: str, asked: AskedDep) -> Response:
    """The figure (SVG, PDF), a table (CSV, Parquet) or the one-file page (HTML), the same bytes each time."""
    from app.analysis.report.report_files import file_names, file_of

    if name not in file_names():
        raise HTTPException(404, f"A report has no file {name!r}; it has {', '.join(file_names())}.")
    study_id = asked.report.collected.study_id
    return Response(
        file_of(asked.report, name),
        media_type=MEDIA_TYPES[name.rsplit(".", 1)[1]],
        headers={"content-disposition": f'attachment; filename="study-{study_id}-{name}"'},
    )
