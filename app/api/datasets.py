"""Datasets: what there is, and taking one in."""

import shutil
import tempfile
from datetime import datetime
from functools import partial
from pathlib import Path

from fastapi import APIRouter, HTTPException, Request
from fastapi.concurrency import run_in_threadpool
from pydantic import BaseModel, Field
from sqlalchemy import distinct, func, select
from sqlalchemy.orm import Session
from starlette.datastructures import UploadFile

from app.api.dependencies import (
    AdminDep,
    AfterDep,
    Id,
    IdentityDep,
    LimitDep,
    Page,
    ServicesDep,
    page_of,
    row_or_404,
)
from app.api.problems import InputError
from app.archives import import_archive
from app.auth import Identity
from app.services import Services
from app.tables import OUTSIDE_STUDIES, Dataset, Object, Registration, Scene, Task

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
                    }
                },
            }
        }
    },
}


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
    created_at: datetime


@router.get("")
def list_datasets(
    services: ServicesDep, _identity: IdentityDep, after: AfterDep = 0, limit: LimitDep = 100
) -> Page:
    """All datasets."""
    with services.database.read() as session:
        return page_of(session, select(Dataset), Dataset.id, after, limit, partial(_out, services, session))


@router.get("/{dataset_id}")
def get_dataset(dataset_id: Id, services: ServicesDep, _identity: IdentityDep) -> DatasetOut:
    """One dataset."""
    with services.database.read() as session:
        return _out(services, session, row_or_404(session, Dataset, dataset_id))


@router.post("", status_code=201, openapi_extra={"requestBody": UPLOAD_BODY})
async def upload_dataset(request: Request, services: ServicesDep, identity: AdminDep) -> DatasetOut:
    """Take a BOP dataset in from a zip file; checked whole before anything is kept."""
    # The body is read here and not by a parameter, so that a stranger's upload is refused unread.
    _check_length(request, services)
    async with request.form() as form:
        file = form.get("file")
        if not isinstance(file, UploadFile):
            raise InputError("body.file: Send the zip file in a form field of this name.")
        return await run_in_threadpool(_take_in, file, services, identity)


def _check_length(request: Request, services: Services) -> None:
    length = request.headers.get("content-length", "")
    if not length.isdigit():
        raise HTTPException(411, "An upload must say how long it is: send Content-Length.")
    if int(length) > services.settings.max_upload_mb * MEGABYTE:
        raise HTTPException(413, f"The upload is larger than {services.settings.max_upload_mb} MB.")


def _take_in(file: UploadFile, services: Services, identity: Identity) -> DatasetOut:
    services.settings.state_dir.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=services.settings.state_dir) as folder:
        archive = Path(folder) / "upload.zip"
        with archive.open("wb") as target:
            shutil.copyfileobj(file.file, target)
        try:
            name = Path(file.filename or "dataset").stem
            max_bytes = services.settings.max_upload_mb * MEGABYTE
            summary = import_archive(services.database, services.files, archive, name, max_bytes)
        except ValueError as error:
            raise InputError(f"{error}.") from error
    services.preparation.look()
    return get_dataset(summary.dataset_id, services, identity)


def _out(services: Services, session: Session, row: Dataset) -> DatasetOut:
    tasks = (
        select(func.count(Task.id)).join(Task.scene).where(Scene.dataset_id == row.id, ~Task.is_for_studies)
    )
    submitted = (
        select(func.count(distinct(Registration.task_id)))
        .join(Registration.task)
        .join(Task.scene)
        .where(Scene.dataset_id == row.id, Registration.state == "submitted", OUTSIDE_STUDIES)
    )
    objects = session.scalars(select(Object).where(Object.dataset_id == row.id)).all()
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
        created_at=row.created_at,
    )
