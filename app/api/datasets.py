"""Datasets: what there is, and taking one in."""

import math
import shutil
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, HTTPException, Query, Request
from fastapi.concurrency import run_in_threadpool
from pydantic import BaseModel, Field
from sqlalchemy import distinct, func, select
from sqlalchemy.orm import Session
from starlette.datastructures import UploadFile

from app.access.auth import Identity
from app.api.dependencies import (
    AdminDep,
    AfterDep,
    Id,
    IdentityDep,
    LimitDep,
    Page,
    ReviewerDep,
    ServicesDep,
    page_of,
    row_or_404,
)
from app.api.problems import InputError
from app.confidence.assessment import Standard
from app.confidence.calibrating import FEWEST
from app.config import LEAST_RISK
from app.datasets.archives import import_archive
from app.datasets.importing import ImplausibleDepthError
from app.services import Services
from app.storage.tables import OUTSIDE_STUDIES, CalibrationRow, Dataset, Object, Registration, Scene, Task
from app.storage.unfinished import unfinished
from registration_core.algorithm import ALGORITHM
from registration_core.judge.acceptance import fewest

router = APIRouter(prefix="/api/datasets", tags=["datasets"])

MEGABYTE = 2**20
UPLOAD_BODY = {
    "required": True,
    "content": {
        "multipart/form-data": {
            "schema": {
                "type": "object",
                "required": ["file"],
                "properties": {
                    "file": {
                        "type": "string",
                        "format": "binary",
                        "description": "A zip file with one BOP dataset.",
                    },
                    "depth_scale": {
                        "type": "number",
                        "exclusiveMinimum": 0,
                        "description": "In the place of the dataset's own: raw depth times it is mm.",
                    },
                },
            }
        }
    },
}


RiskQuery = Annotated[float | None, Query(ge=LEAST_RISK, lt=1, allow_inf_nan=False)]


class CalibrationOut(BaseModel):
    """What a dataset's own registrations have taught of the confidence."""

    registrations: int
    is_current: bool = Field(description="Whether it speaks of the snaps of this version; else it rests.")
    stretch: float
    shift: float = Field(description="Like `stretch` of the log-odds.")
    gains: dict[str, Any] = Field(description="Before and after, cross-validated.")
    created_at: datetime


class Risk(BaseModel):
    """Share of wrong poses among those that the machine may accept."""

    risk: float | None = Field(
        ge=LEAST_RISK, lt=1, allow_inf_nan=False, description="Null: as the settings say."
    )


class AcceptanceOut(BaseModel):
    """From which confidence on the machine may accept a pose, and how that is known."""

    risk: float
    threshold: float | None = Field(
        description="The confidence; null where none is known that bears the risk out."
    )
    is_own: bool = Field(
        description="Whether the dataset's own registrations tell, not the shipped calibration."
    )
    rests_on: int = Field(description="So many registrations, or estimates of the shipped calibration.")
    needs: int = Field(description="The fewest registrations of its own that could bear this risk out.")


class WarningOut(BaseModel):
    """Something that looked odd when a dataset was imported."""

    text: str
    images: list[str] = Field(description='Those that show it, as "test/000001, image 3"; the first few.')
    accepted: bool = Field(description="Whether a lead said that it is right so.")


class DatasetOut(BaseModel):
    """A dataset and how far its work is."""

    id: int
    name: str
    objects: int
    suggestions_open: int = Field(description="Objects whose suggested symmetries wait for a decision.")
    objects_prepared: int = Field(description="Objects of which workers have built what snaps need.")
    problems: list[str] = Field(description="Objects that cannot be snapped to, and why.")
    scenes: int
    tasks: int
    tasks_submitted: int
    modes: list[str] = Field(description="Of its tasks.")
    conditions: list[str] = Field(description="Of its tasks.")
    risk: float = Field(description="Share of wrong poses among those that the machine may accept.")
    risk_is_set: bool = Field(description="Whether it was set for this dataset; else the settings say it.")
    risk_of_settings: float
    acceptance: AcceptanceOut
    calibration: CalibrationOut | None = Field(description="Null where the shipped one is used.")
    warnings: list[WarningOut] = Field(description="What looked odd when it was imported, but was taken.")
    created_at: datetime


@router.get("")
def list_datasets(
    services: ServicesDep, _identity: IdentityDep, after: AfterDep = 0, limit: LimitDep = 100
) -> Page[DatasetOut]:
    """All datasets."""
    with services.database.read() as session:
        return page_of(session, select(Dataset), Dataset.id, after, limit, partial(_out, services, session))


@router.get("/{dataset_id}")
def get_dataset(dataset_id: Id, services: ServicesDep, _identity: IdentityDep) -> DatasetOut:
    """One dataset."""
    with services.database.read() as session:
        return _out(services, session, row_or_404(session, Dataset, dataset_id))


@router.get("/{dataset_id}/acceptance")
def get_acceptance(
    dataset_id: Id, services: ServicesDep, _identity: ReviewerDep, risk: RiskQuery = None
) -> AcceptanceOut:
    """What a risk would ask for, before it is set; the present one where none is given."""
    with services.database.read() as session:
        return _acceptance_out(services.standards.of_row(row_or_404(session, Dataset, dataset_id), risk))


@router.put("/{dataset_id}/risk")
def set_risk(dataset_id: Id, body: Risk, services: ServicesDep, _identity: ReviewerDep) -> DatasetOut:
    """Let the machine accept more or less; snaps from now on go by it."""
    with services.database.write() as session:
        row_or_404(session, Dataset, dataset_id).risk = body.risk
    with services.database.read() as session:
        return _out(services, session, row_or_404(session, Dataset, dataset_id))


@router.post("/{dataset_id}/warnings/accept")
def accept_warnings(dataset_id: Id, services: ServicesDep, _identity: ReviewerDep) -> DatasetOut:
    """Say that what looked odd when the dataset was imported is right so."""
    with services.database.write() as session:
        row = row_or_404(session, Dataset, dataset_id)
        row.warnings = [{**warning, "accepted": True} for warning in row.warnings]
    return get_dataset(dataset_id, services, _identity)


@router.post("", status_code=201, openapi_extra={"requestBody": UPLOAD_BODY})
async def upload_dataset(request: Request, services: ServicesDep, identity: AdminDep) -> DatasetOut:
    """Take a BOP dataset in from a zip file; checked whole before anything is kept."""
    # The body is read here and not by a parameter, so that a stranger's upload is refused unread.
    _check_length(request, services)
    async with request.form() as form:
        file = form.get("file")
        if not isinstance(file, UploadFile):
            raise InputError("body.file: Send the zip file in a form field of this name.")
        depth_scale = _depth_scale(form.get("depth_scale"))
        return await run_in_threadpool(_take_in, file, depth_scale, services, identity)


def _check_length(request: Request, services: Services) -> None:
    length = request.headers.get("content-length", "")
    if not length.isdigit():
        raise HTTPException(411, "An upload must say how long it is: send Content-Length.")
    if int(length) > services.settings.max_upload_mb * MEGABYTE:
        raise HTTPException(413, f"The upload is larger than {services.settings.max_upload_mb} MB.")


def _depth_scale(text: UploadFile | str | None) -> float | None:
    if text is None:
        return None
    try:
        return float(str(text))
    except ValueError:
        raise InputError("body.depth_scale: Must be a number: raw depth times it is millimetres.") from None


def _take_in(
    file: UploadFile, depth_scale: float | None, services: Services, identity: Identity
) -> DatasetOut:
    services.settings.state_dir.mkdir(parents=True, exist_ok=True)
    with unfinished(services.settings.state_dir) as folder:
        archive = folder / "upload.zip"
        with archive.open("wb") as target:
            shutil.copyfileobj(file.file, target)
        try:
            name = Path(file.filename or "dataset").stem
            max_bytes = services.settings.max_upload_mb * MEGABYTE
            summary = import_archive(services.database, services.files, archive, name, max_bytes, depth_scale)
        except ImplausibleDepthError as error:
            raise InputError(f"{error}.", {"depth_scale": error.suggested}) from error
        except ValueError as error:
            raise InputError(f"{error}.") from error
    services.preparation.look()
    return get_dataset(summary.dataset_id, services, identity)


def _calibration_out(row: CalibrationRow | None) -> CalibrationOut | None:
    if row is None:
        return None
    return CalibrationOut(
        registrations=len(row.confidences),
        is_current=row.algorithm == ALGORITHM,
        stretch=row.stretch,
        shift=row.shift,
        gains=row.gains,
        created_at=row.created_at,
    )


def _acceptance_out(standard: Standard) -> AcceptanceOut:
    return AcceptanceOut(
        risk=standard.risk,
        threshold=standard.threshold if standard.threshold <= 1.0 else None,
        is_own=standard.is_own,
        rests_on=standard.rests_on,
        needs=max(FEWEST, math.ceil(fewest(standard.risk))),
    )


def _out(services: Services, session: Session, row: Dataset) -> DatasetOut:
    ordinary = (Task.scene_id == Scene.id) & (Scene.dataset_id == row.id) & ~Task.is_for_studies
    tasks = select(func.count(Task.id)).where(ordinary)
    submitted = (
        select(func.count(distinct(Registration.task_id)))
        .join(Registration.task)
        .join(Task.scene)
        .where(Scene.dataset_id == row.id, Registration.state == "submitted", OUTSIDE_STUDIES)
    )
    objects = session.scalars(select(Object).where(Object.dataset_id == row.id)).all()
    standard = services.standards.of_row(row)
    return DatasetOut(
        id=row.id,
        name=row.name,
        objects=len(objects),
        suggestions_open=sum(item.suggestions_open for item in objects),
        objects_prepared=sum(map(services.preparation.is_prepared, objects)),
        problems=[problem for problem in map(services.preparation.problem, objects) if problem],
        scenes=session.scalar(select(func.count(Scene.id)).where(Scene.dataset_id == row.id)) or 0,
        tasks=session.scalar(tasks) or 0,
        tasks_submitted=session.scalar(submitted) or 0,
        modes=sorted(session.scalars(select(Task.mode).where(ordinary).distinct())),
        conditions=sorted(session.scalars(select(Task.condition).where(ordinary).distinct())),
        risk=standard.risk,
        risk_is_set=row.risk is not None,
        risk_of_settings=services.standards.risk,
        acceptance=_acceptance_out(standard),
        calibration=_calibration_out(row.calibration),
        warnings=[WarningOut(**warning) for warning in row.warnings],
        created_at=row.created_at,
    )
