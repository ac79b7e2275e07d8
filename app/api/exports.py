"""Exports: starting one, how far it is, and the finished archive."""

from datetime import datetime
from typing import Annotated, Any

from fastapi import APIRouter, HTTPException
from fastapi.responses import FileResponse
from pydantic import AfterValidator, BaseModel, Field
from sqlalchemy import select
from sqlalchemy.orm import joinedload

from app.api.dependencies import (
    AdminDep,
    AfterDep,
    Id,
    LimitDep,
    Page,
    QueryId,
    ServicesDep,
    page_of,
    row_or_404,
)
from app.api.problems import InputError
from app.export.content.selection import Choice
from app.export.formats.registry import formats
from app.services import Services
from app.storage.tables import Dataset, Export, Scene

router = APIRouter(prefix="/api/exports", tags=["exports"])

RowId = Annotated[int, Field(ge=1, le=2**31 - 1)]


def _known_format(name: str) -> str:
    if name not in formats():
        raise ValueError(f"there is no format {name!r}; choose one of {', '.join(formats())}")
    return name


FormatName = Annotated[str, AfterValidator(_known_format), Field(json_schema_extra={"enum": list(formats())})]


class FormatOut(BaseModel):
    """What an export can be given as."""

    name: str
    title: str


class NewExport(BaseModel):
    """What is to be exported, and how."""

    dataset_id: int = Field(ge=1, le=2**31 - 1)
    format: FormatName = Field("bop", description='A whole dataset, or "csv": its poses alone.')
    scene_ids: list[RowId] | None = Field(
        None, min_length=1, max_length=10_000, description="Scenes to export; all where left out."
    )
    without: list[RowId] = Field(
        [], max_length=10_000, description="Registrations to leave out, such as those that failed the checks."
    )


class FailureOut(BaseModel):
    """An object that did not pass the checks."""

    registration_id: int
    task_id: int
    object: str
    operator: str
    scene: str
    image_id: int
    reason: str
    picture_url: str


class ExportId(BaseModel):
    """The export that was begun."""

    id: int


class ExportOut(BaseModel):
    """How an export stands."""

    id: int
    dataset_id: int
    dataset_name: str
    format: str
    state: str
    progress: float
    message: str
    scene_ids: list[int] | None
    without: list[int]
    failures: list[FailureOut] = Field(description="Objects that did not pass; `without` exports the rest.")
    created_at: datetime
    bytes: int | None
    download_url: str | None


@router.post("", status_code=202)
def start_export(body: NewExport, services: ServicesDep, identity: AdminDep) -> ExportId:
    """Start an export of the submitted poses of a dataset, or of a part of it."""
    with services.database.read() as session:
        if session.get(Dataset, body.dataset_id) is None:
            raise InputError(f"dataset_id {body.dataset_id} is no dataset; choose one of GET /api/datasets.")
        own = set(session.scalars(select(Scene.id).where(Scene.dataset_id == body.dataset_id)))
    strange = sorted(set(body.scene_ids or ()) - own)
    if strange:
        raise InputError(f"scene_ids: scene {strange[0]} is not of dataset {body.dataset_id}.")
    choice = Choice(None if body.scene_ids is None else frozenset(body.scene_ids), frozenset(body.without))
    return ExportId(id=services.export_jobs.start(body.dataset_id, body.format, identity.user_id, choice).id)


@router.get("/formats")
def list_formats(_identity: AdminDep) -> list[FormatOut]:
    """What an export can be given as."""
    return [FormatOut(name=one.name, title=one.title) for one in formats().values()]


@router.get("")
def list_exports(
    services: ServicesDep,
    _identity: AdminDep,
    dataset_id: QueryId = None,
    after: AfterDep = 0,
    limit: LimitDep = 100,
) -> Page[ExportOut]:
    """All exports, or those of one dataset."""
    query = select(Export).options(joinedload(Export.dataset))
    if dataset_id is not None:
        query = query.where(Export.dataset_id == dataset_id)
    with services.database.read() as session:
        return page_of(session, query, Export.id, after, limit, lambda row: _out(services, row))


@router.get("/{export_id}")
def get_export(export_id: Id, services: ServicesDep, _identity: AdminDep) -> ExportOut:
    """How an export stands."""
    return _out(services, _export(services, export_id))


@router.get("/{export_id}/failures/{registration_id}.jpg", response_class=FileResponse)
def get_failure_picture(
    export_id: Id, registration_id: Id, services: ServicesDep, _identity: AdminDep
) -> FileResponse:
    """Where an object that did not pass was put, drawn into what the camera saw."""
    for failure in _export(services, export_id).failures:
        if failure["registration_id"] == registration_id:
            return FileResponse(services.files.path(failure["picture_hash"]), media_type="image/jpeg")
    raise HTTPException(404, f"Export {export_id} has no failure of registration {registration_id}.")


@router.get("/{export_id}/download", response_class=FileResponse)
def download(export_id: Id, services: ServicesDep, _identity: AdminDep) -> FileResponse:
    """The finished archive; parts of it by Range, named by its content."""
    row = _export(services, export_id)
    if row.file_hash is None:
        raise HTTPException(409, f"Export {export_id} is {row.state}; there is nothing to download.")
    return FileResponse(
        services.files.path(row.file_hash),
        media_type="application/zip",
        filename=f"{row.dataset.name}-{row.file_hash[:12]}.zip",
        headers={"etag": f'"{row.file_hash}"'},
    )


def _export(services: Services, export_id: int) -> Export:
    with services.database.read() as session:
        return row_or_404(session, Export, export_id, joinedload(Export.dataset))


def _out(services: Services, row: Export) -> ExportOut:
    size = services.files.size(row.file_hash) if row.file_hash else None
    return ExportOut(
        id=row.id,
        dataset_id=row.dataset_id,
        dataset_name=row.dataset.name,
        format=row.format,
        state=row.state,
        progress=row.progress,
        message=row.message,
        scene_ids=row.choice["scene_ids"],
        without=row.choice["without"],
        failures=[_failure_out(row, failure) for failure in row.failures],
        created_at=row.created_at,
        bytes=size,
        download_url=f"/api/exports/{row.id}/download" if row.file_hash else None,
    )


def _failure_out(row: Export, failure: dict[str, Any]) -> FailureOut:
    told = {field: failure[field] for field in FailureOut.model_fields if field in failure}
    return FailureOut(**told, picture_url=f"/api/exports/{row.id}/failures/{failure['registration_id']}.jpg")
