"""The symmetries of an object: its versions, and a lead's decisions."""

from datetime import datetime
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter
from pydantic import BaseModel, Field

from app.api.dependencies import (
    AdminDep,
    Id,
    IdentityDep,
    ServicesDep,
    row_or_404,
)
from app.api.objects import ObjectDetail, detail_of
from app.api.problems import InputError
from app.api.tasks import Named
from app.datasets.symmetries import axes_in, decide, restore, versions_of
from app.services import Services
from app.storage.tables import Object, SymmetryVersion
from registration_core import SymmetryAxis, residual_of
from registration_core.geometry import pose
from registration_core.symmetry.axes import HIGHEST_FOLD

router = APIRouter(prefix="/api/objects", tags=["objects"])

MOST_AXES = 31
"""As an icosahedron has them."""

Number = Annotated[float, Field(ge=-pose.FARTHEST, le=pose.FARTHEST, allow_inf_nan=False)]
Triple = tuple[Number, Number, Number]


class NewAxis(BaseModel):
    """An axis about which the object can be turned onto itself, in the mesh's frame."""

    axis: Triple = Field(description="Its direction, of any length but 0.", examples=[[0, 0, 1]])
    point: Triple = Field((0.0, 0.0, 0.0), description="A point that it goes through, metres.")
    fold: int | None = Field(
        ge=2, le=HIGHEST_FOLD, description="It turns by 1 / fold of a full turn; null: by any angle."
    )


class Decision(BaseModel):
    """What an object's symmetries are to be: `axes`, or an earlier version by `restore`."""

    axes: list[NewAxis] | None = Field(
        None, max_length=MOST_AXES, description="All that it has; none where it has no symmetries."
    )
    restore: int | None = Field(None, ge=1, le=2**31 - 1, description="The version to bring back.")
    version: int | None = Field(
        None, description="The version that was seen: refused with 409 where another one is present by now."
    )


class ResidualOut(BaseModel):
    """How far turns about an axis carry the surface off itself."""

    residual: float = Field(description="Metres: 99 % of the turned surface is nearer to the surface.")


class VersionOut(BaseModel):
    """What the symmetries were from a time on."""

    version: int
    symmetries: dict[str, Any]
    axes: list[Any]
    restores: int | None = Field(description="The version that this one brought back.")
    user: Named | None = Field(description="Who decided; null for what was imported.")
    utc: datetime


@router.get("/{object_id}/symmetries")
def get_versions(object_id: Id, services: ServicesDep, _identity: IdentityDep) -> list[VersionOut]:
    """All versions of an object's symmetries, the newest first."""
    with services.database.read() as session:
        row_or_404(session, Object, object_id)
        return [_version_out(version) for version in versions_of(session, object_id)]


@router.put("/{object_id}/symmetries")
def put_symmetries(object_id: Id, body: Decision, services: ServicesDep, identity: AdminDep) -> ObjectDetail:
    """Decide what an object's symmetries are; every decision is a new version, which the next snap uses."""
    if (body.axes is None) == (body.restore is None):
        raise InputError("body: Send either axes, an empty list for none, or the version to restore.")
    axes = [_axis_of(axis, f"body.axes[{number}]") for number, axis in enumerate(body.axes or ())]
    model = services.data.model(_row(services, object_id))
    with services.database.write() as session:
        row = row_or_404(session, Object, object_id)
        try:
            if body.restore is None:
                decide(session, row, axes, model, identity.user_id, body.version)
            else:
                restore(session, row, body.restore, identity.user_id, body.version)
        except ValueError as error:
            raise InputError(f"body.{error}.") from error
    services.live_sessions.renew_object(object_id)
    services.preparation.look()
    return detail_of(services, _row(services, object_id))


@router.post("/{object_id}/residual")
def measure_residual(
    object_id: Id, body: NewAxis, services: ServicesDep, _identity: IdentityDep
) -> ResidualOut:
    """Measure how well an axis fits; that changes nothing."""
    axis = _axis_of(body, "body")
    return ResidualOut(residual=residual_of(services.data.model(_row(services, object_id)), axis))


def _row(services: Services, object_id: int) -> Object:
    with services.database.read() as session:
        return row_or_404(session, Object, object_id)


def _axis_of(given: NewAxis, where: str) -> SymmetryAxis:
    direction = np.array(given.axis)
    largest = np.abs(direction).max()
    if largest == 0.0:
        raise InputError(f"{where}.axis: The direction (0, 0, 0) is none; give one such as (0, 0, 1).")
    direction = direction / largest  # or squares of tiny numbers would be 0
    return SymmetryAxis(direction / np.linalg.norm(direction), np.array(given.point), given.fold)


def _version_out(row: SymmetryVersion) -> VersionOut:
    return VersionOut(
        version=row.version,
        symmetries=row.symmetries,
        axes=axes_in(row),
        restores=row.restores,
        user=Named(id=row.user.id, name=row.user.name) if row.user else None,
        utc=row.utc,
    )
