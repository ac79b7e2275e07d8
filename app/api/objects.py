"""Objects and their meshes."""

from typing import Any

from fastapi import APIRouter, Response
from fastapi.responses import FileResponse
from pydantic import BaseModel
from sqlalchemy import select

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
from app.auth import Identity
from app.outline_mesh import packed
from app.services import Services
from app.tables import Object, Task
from registration_core.object_model import read_mesh

router = APIRouter(prefix="/api/objects", tags=["objects"])


class ObjectOut(BaseModel):
    """A known object; lengths in metres, in the mesh's own frame."""

    id: int
    dataset_id: int
    obj_id: int
    name: str
    diameter: float
    symmetries: dict[str, Any]
    mesh_url: str
    outline_mesh_url: str


@router.get("")
def list_objects(
    services: ServicesDep,
    _identity: IdentityDep,
    dataset_id: QueryId = None,
    after: AfterDep = 0,
    limit: LimitDep = 100,
) -> Page:
    """All objects, or those of one dataset."""
    query = select(Object)
    if dataset_id is not None:
        query = query.where(Object.dataset_id == dataset_id)
    with services.database.read() as session:
        return page_of(session, query, Object.id, after, limit, _out)


@router.get("/{object_id}")
def get_object(object_id: Id, services: ServicesDep, identity: AnyoneDep) -> ObjectOut:
    """One object."""
    return _out(_object(services, object_id, identity))


@router.get("/{object_id}/mesh.ply", response_class=Response)
def get_mesh(object_id: Id, services: ServicesDep, identity: IdentityDep) -> Response:
    """The object's mesh, millimetres, as it was imported."""
    row = _object(services, object_id, identity)
    path = services.files.path(row.mesh_hash)
    if row.mesh_format == "ply":
        return FileResponse(path, media_type="application/octet-stream")
    content = read_mesh(path.read_bytes(), row.mesh_format).export(file_type="ply")
    return Response(content, media_type="application/octet-stream")


@router.get("/{object_id}/outline.mesh", response_class=Response)
def get_outline_mesh(object_id: Id, services: ServicesDep, identity: AnyoneDep) -> Response:
    """The mesh thinned for drawing outlines: uint32 V and F, float32 (V, 3) in metres, uint32 (F, 3)."""
    content = packed(services.data.thinned_model(_object(services, object_id, identity)))
    return Response(content, media_type="application/octet-stream", headers=FOREVER)


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
        mesh_url=f"/api/objects/{row.id}/mesh.ply",
        outline_mesh_url=f"/api/objects/{row.id}/outline.mesh?content={row.mesh_hash[:16]}",
    )
