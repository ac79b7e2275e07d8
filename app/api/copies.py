"""Copying a pose from another frame of the video, or from another operator."""

from fastapi import APIRouter
from pydantic import BaseModel, Field

from app.access.auth import Identity
from app.api.dependencies import AnyoneDep, LiveSessionDep, ServicesDep
from app.api.registration_state import RegistrationOut, registration_out
from app.labeling.live.live_session import LiveSession
from app.labeling.live.sessions import NotFoundError
from app.labeling.moves.copying import Copy, copies_for
from app.labeling.moves.history import PosedBy
from app.labeling.moves.permissions import require
from app.services import Services
from app.storage.tables import Pose

router = APIRouter(prefix="/api/registrations", tags=["copies"])


class CopyOut(BaseModel):
    """A pose that can be copied."""

    registration_id: int = Field(description="Whose pose it is.")
    operator: str
    is_mine: bool
    state: str
    is_neighbour: bool = Field(description="Another frame's, in the axes of the camera; or else this task's.")
    scene: str
    name: str = Field(description="Of the object, as that of its task.")
    confidence: float | None
    posed_by: PosedBy
    T_world_object: Pose = Field(description="In the world that it is copied into.")
    thumbnail_url: str


class Copies(BaseModel):
    """What can be copied."""

    items: list[CopyOut]


class CopyChoice(BaseModel):
    """Whose pose is to be copied."""

    registration_id: int = Field(ge=1, le=2**31 - 1)


@router.get("/{registration_id}/copies")
def list_copies(live_session: LiveSessionDep, services: ServicesDep, identity: AnyoneDep) -> Copies:
    """Poses that can be copied: of other operators, then of the neighbouring frames, nearest first."""
    found = _copies(live_session, services, identity)
    return Copies(items=[_copy_out(copy, identity) for copy in found.values()])


@router.post("/{registration_id}/copy")
def copy_pose(
    body: CopyChoice, live_session: LiveSessionDep, services: ServicesDep, identity: AnyoneDep
) -> RegistrationOut:
    """Put the object where another registration has it."""
    copy = _copies(live_session, services, identity).get(body.registration_id)
    if copy is None:
        raise NotFoundError(f"There is no pose of a registration {body.registration_id} to copy here.")
    detail = {"registration_id": copy.source.id, "user_id": copy.source.user_id}
    live_session.session.set_pose(copy.T_world_object, identity.actor, "copy", {"source": detail})
    return registration_out(live_session)


def _copies(live_session: LiveSession, services: Services, identity: Identity) -> dict[int, Copy]:
    require(live_session.session.tools, "copy")
    found = copies_for(live_session.registration, identity, services.database, services.log)
    return {copy.source.id: copy for copy in found}


def _copy_out(copy: Copy, identity: Identity) -> CopyOut:
    source = copy.source
    return CopyOut(
        registration_id=source.id,
        operator=source.user.name,
        is_mine=source.user_id == identity.user_id,
        state=source.state,
        is_neighbour=copy.is_neighbour,
        scene=source.task.scene.label,
        name=source.task.name,
        confidence=copy.confidence,
        posed_by=copy.posed_by,
        T_world_object=copy.T_world_object.tolist(),
        thumbnail_url=f"/api/tasks/{source.task_id}/thumbnail.jpg",
    )
