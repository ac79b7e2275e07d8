"""What else is in the scene of a registration, and whether the 3-D view shows it."""

from fastapi import APIRouter
from pydantic import BaseModel, Field

from app.api.dependencies import LiveSessionDep, Page
from app.labeling.scene.instances import SceneInstance
from app.storage.tables import Pose

router = APIRouter(prefix="/api/registrations", tags=["registrations"])


class ThingOut(BaseModel):
    """One instance of an object in the scene."""

    task_id: int
    name: str = Field(description="With its number, where the object is there several times.")
    is_current: bool = Field(description="Whether it is this registration's own.")
    state: str = Field(
        description="open, submitted or skipped: of my registration, if done, else of the newest that is."
    )
    skip_reason: str | None
    color: str = Field(description="Of its mesh in the 3-D view, #rrggbb.")
    registration_id: int | None = Field(description="Of the pose, if it is submitted.")
    T_world_object: Pose | None


class Shown(BaseModel):
    """Whether the 3-D view shows the things that are done."""

    on: bool


@router.get("/{registration_id}/things")
def list_things(live_session: LiveSessionDep) -> Page[ThingOut]:
    """What is asked for in the scene, in the order of the tasks; snaps know those with a pose."""
    return Page(items=[_out(thing) for thing in live_session.neighbours.things], next=None)


@router.put("/{registration_id}/things", status_code=204)
def show_things(body: Shown, live_session: LiveSessionDep) -> None:
    """Show the things that are done in the operator's 3-D view, or hide them."""
    live_session.neighbours.show(body.on)


def _out(thing: SceneInstance) -> ThingOut:
    known = thing.known
    return ThingOut(
        task_id=thing.task_id,
        name=thing.name,
        is_current=thing.is_current,
        state=thing.state,
        skip_reason=thing.skip_reason,
        color=thing.color,
        registration_id=known.registration_id if known else None,
        T_world_object=known.T_world_object.tolist() if known else None,
    )
