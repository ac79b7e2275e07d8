"""What is not known about the present pose, and whether the 3-D view shows it."""

from fastapi import APIRouter
from pydantic import BaseModel, Field

from app.api.dependencies import LiveSessionDep, ServicesDep
from app.confidence.ambiguity_words import Kind, Motion, names_of_drawn, sentence
from app.labeling.moves.pose_record import ActionError

router = APIRouter(prefix="/api/registrations", tags=["uncertainty"])


class UnknownMotionOut(BaseModel):
    """A motion of the object that depth cannot tell from none."""

    kind: Kind
    motion: Motion
    axis: tuple[float, float, float] = Field(description="Direction in the world.")
    extent: float = Field(
        description="Radians or metres: where the mode lies; how far to either side (95 %)."
    )
    text: str = Field(description="As people read it, beside the name of what the 3-D view draws of it.")


class UncertaintyOut(BaseModel):
    """How far off the present pose may be, as the snap that it stems from says."""

    snap_id: str | None = Field(description="Null where it stems from none: then nothing is known.")
    translation: float | None = Field(description="Metres: 95 % lie within, of the object's middle.")
    rotation: float | None = Field(description="Radians: 95 % lie within.")
    unknown: list[UnknownMotionOut]


class Shown(BaseModel):
    """Whether the 3-D view shows it."""

    shown: bool


@router.get("/{registration_id}/uncertainty")
def get_uncertainty(live_session: LiveSessionDep, services: ServicesDep) -> UncertaintyOut:
    """How far off the present pose may be, and what depth does not tell about it."""
    snap_id = live_session.session.snapshot().estimate_snap_id
    known = services.live_sessions.uncertainty(live_session, snap_id)
    if known is None:
        return UncertaintyOut(snap_id=None, translation=None, rotation=None, unknown=[])
    unknown = [
        UnknownMotionOut(
            kind=one.kind,
            motion=one.motion,
            axis=one.axis.tolist(),
            extent=one.extent,
            text=sentence(drawn, one, one.axis_name),
        )
        for drawn, one in zip(names_of_drawn(known.unknown), known.unknown, strict=True)
    ]
    return UncertaintyOut(
        snap_id=snap_id, translation=known.translation, rotation=known.rotation, unknown=unknown
    )


@router.put("/{registration_id}/uncertainty", status_code=204)
def show_uncertainty(body: Shown, live_session: LiveSessionDep) -> None:
    """Show it in the operator's 3-D view, or hide it there."""
    if live_session.view is None:
        raise ActionError("Nobody has the 3-D view of this registration open.")
    live_session.view.uncertainty.visible = body.shown
