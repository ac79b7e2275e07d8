"""Objects and their meshes."""

from typing import Any

from fastapi import APIRouter, Response
from pydantic import BaseModel, Field
from sqlalchemy import select

from app.access.auth import Identity
from app.api.dependencies import (
    AfterDep,
    AnyoneDep,
    Id,
    IdentityDep,
    LimitDep,
    Page,
    QueryId,
    ServicesDep,
    check_sees,
    page_of,
    row_or_404,
)
from app.api.scenes import FOREVER
from app.datasets import textured_mesh
from app.datasets.outline_mesh import packed
from app.datasets.symmetries import present_axes, suggestions_of, version_before
from app.labeling.live.sessions import NotFoundError
from app.services import Services
from app.storage.tables import Object, Task
from registration_core.geometry.mesh_file import plain_ply, read_mesh

router = APIRouter(prefix="/api/objects", tags=["objects"])


class ObjectOut(BaseModel):
    """A known object; lengths in metres, in the mesh's own frame."""

    id: int
    dataset_id: int
    obj_id: int
    name: str
    diameter: float
    symmetries: dict[str, Any] = Field(description="The present ones, as BOP writes them, but in metres.")
    symmetries_version: int
    suggestions_open: bool = Field(
        description="It came without symmetries, some are suggested, and nobody has decided yet."
    )
    mesh_url: str
    outline_mesh_url: str


class AxisOut(BaseModel):
    """An axis of symmetry."""

    axis: tuple[float, float, float] = Field(description="Its direction.")
    point: tuple[float, float, float] = Field(description="A point that it goes through.")
    fold: int | None = Field(description="It turns by 1 / fold of a full turn; null: by any angle.")


class SuggestionOut(AxisOut):
    """One that was found on the mesh."""

    residual: float = Field(description="99 % of the turned surface is nearer than this to the surface.")


class ObjectDetail(ObjectOut):
    """The same with its size and its axes of symmetry."""

    size: tuple[float, float, float] = Field(description="Along the axes of the mesh.")
    centre: tuple[float, float, float] = Field(description="Of the box along these axes.")
    axes: list[AxisOut] = Field(description="Which the present symmetries are made of.")
    suggestions: list[SuggestionOut] | None = Field(
        description="Best first; null where the mesh was never looked into: it came with symmetries, or was "
        "imported by an older version, and has not had its turn yet."
    )
    textured_mesh_url: str | None = Field(description="Null where the mesh has no colours of its own.")
    undo_version: int | None = Field(description="The version that undo restores.")


@router.get("")
def list_objects(
    services: ServicesDep,
    _identity: IdentityDep,
    dataset_id: QueryId = None,
    suggestions_open: bool | None = None,
    after: AfterDep = 0,
    limit: LimitDep = 100,
) -> Page[ObjectOut]:
    """All objects, or those of one dataset, or those whose suggested symmetries wait for a decision."""
    query = select(Object)
    if suggestions_open is not None:
        query = query.where(Object.suggestions_open == suggestions_open)
    if dataset_id is not None:
        query = query.where(Object.dataset_id == dataset_id)
    with services.database.read() as session:
        return page_of(session, query, Object.id, after, limit, _out)


@router.get("/{object_id}")
def get_object(object_id: Id, services: ServicesDep, identity: AnyoneDep) -> ObjectDetail:
    """One object."""
    return detail_of(services, _object(services, object_id, identity))


@router.get("/{object_id}/mesh.ply", response_class=Response)
def get_mesh(object_id: Id, services: ServicesDep, identity: IdentityDep) -> Response:
    """The object's mesh as PLY, millimetres: triangles, little-endian, as every tool reads it."""
    row = _object(services, object_id, identity)
    mesh = read_mesh(services.files.read(row.mesh_hash), row.mesh_format)
    return Response(plain_ply(mesh), media_type="application/octet-stream")


@router.get("/{object_id}/outline.mesh", response_class=Response)
def get_outline_mesh(object_id: Id, services: ServicesDep, identity: AnyoneDep) -> Response:
    """The mesh thinned for drawing outlines: uint32 V and F, float32 (V, 3) in metres, uint32 (F, 3)."""
    content = packed(services.data.thinned_model(_object(services, object_id, identity)))
    return Response(content, media_type="application/octet-stream", headers=FOREVER)


@router.get("/{object_id}/textured.mesh", response_class=Response)
def get_textured_mesh(object_id: Id, services: ServicesDep, identity: AnyoneDep) -> Response:
    """The mesh for drawing, with its texture or vertex colours, as `docs/rest.md` lays it out."""
    mesh = services.data.textured(_object(services, object_id, identity))
    if mesh is None:
        raise NotFoundError(f"Object {object_id} has no colours of its own.")
    return Response(textured_mesh.packed(mesh), media_type="application/octet-stream", headers=FOREVER)


def detail_of(services: Services, row: Object) -> ObjectDetail:
    """An object as JSON, with all that is known of it."""
    vertices = services.data.model(row).vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    with services.database.read() as session:
        return ObjectDetail(
            **_out(row).model_dump(),
            size=(high - low).tolist(),
            centre=((low + high) / 2.0).tolist(),
            axes=present_axes(session, row),
            suggestions=suggestions_of(session, row),
            textured_mesh_url=None if services.data.textured(row) is None else _textured_url(row),
            undo_version=version_before(session, row),
        )


def _textured_url(row: Object) -> str:
    """Changes with what is behind it, since that is kept by browsers."""
    content = f"{row.mesh_hash[:16]}{(row.texture_hash or '')[:16]}"
    return f"/api/objects/{row.id}/textured.mesh?content={content}"


def _object(services: Services, object_id: int, identity: Identity) -> Object:
    check_sees(services, identity, Task.object_id == object_id, f"object {object_id}")
    with services.database.read() as session:
        return row_or_404(session, Object, object_id)


def _out(row: Object) -> ObjectOut:
    return ObjectOut(
        id=row.id,
        dataset_id=row.dataset_id,
        obj_id=row.obj_id,
        name=row.name,
        diameter=row.diameter,
        symmetries=row.symmetries,
        symmetries_version=row.symmetries_version,
        suggestions_open=row.suggestions_open,
        mesh_url=f"/api/objects/{row.id}/mesh.ply",
        outline_mesh_url=f"/api/objects/{row.id}/outline.mesh?content={row.mesh_hash[:16]}",
    )
