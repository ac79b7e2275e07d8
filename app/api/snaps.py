"""Snaps: asking for one, how it stands, and cancelling it."""

from math import pi
from typing import Annotated, Any, Literal, cast

from fastapi import APIRouter, HTTPException
from pydantic import BaseModel, Field

from app.access.auth import Identity
from app.api.dependencies import AnyoneDep, LiveSessionDep, ServicesDep
from app.api.problems import InputError
from app.api.registration_state import AssessmentOut
from app.labeling.snaps.start_spread import Unsaid
from app.services import Services
from app.storage.tables import EstimateRow, Event, FrameUse, Method, Pose
from app.workers.methods import method_of
from app.workers.pool import Standing
from registration_core import SnapConfig

router = APIRouter(prefix="/api", tags=["snaps"])

SnapState = Literal["queued", "running", "done", "cancelled", "failed"]
OUTCOMES: dict[str, SnapState] = {
    "snap_applied": "done",
    "snap_offered": "done",
    "accept": "done",  # of a live one, which is written down only then
    "snap_cancelled": "cancelled",
    "snap_failed": "failed",
}
INTERRUPTED = "The server stopped while this snap ran. Nothing is lost; ask for another one."

MOST_FRAMES = 8
"""That a snap may be asked to use: each costs time."""

FrameId = Annotated[int, Field(ge=1, le=2**31 - 1)]
Metres = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
Radians = Annotated[float, Field(ge=0, le=pi, allow_inf_nan=False)]


class NewSnap(BaseModel):
    """How to snap; everything has a default."""

    seed: int | None = Field(None, ge=0, lt=2**63, description="For a result that can be repeated.")
    config: dict[str, Any] | None = Field(
        None,
        description='Changes to the configuration of {"preset": "default"} or {"preset": "paper"}; where no '
        "preset is named, of the method that is chosen.",
        examples=[{}],
    )
    start_spread: tuple[Metres, Radians] | None = Field(
        default_factory=lambda: None,  # which OpenAPI does not show: left out is something else than null
        description="How far off the present pose may be, metres and radians; null where that is unknown. "
        "Left out, it is told from the last drags.",
        examples=[[0.03, 0.35]],
    )
    frames: FrameUse | Annotated[list[FrameId], Field(min_length=1, max_length=MOST_FRAMES)] | None = Field(
        None,
        description="The frames that it uses: those that see the object best, the one that is shown, "
        "or these; where null, as is chosen.",
        examples=["auto"],
    )


class HypothesisOut(BaseModel):
    """One of the poses that fit the data."""

    T_camera_object: Pose
    weight: float = Field(description="Share of the belief among those that were found.")
    chance: float | None = Field(
        None, description="Of a proposal: how likely the object is there at all; null where not known."
    )


class AmbiguityOut(BaseModel):
    """Something about a pose that the depth does not tell."""

    kind: Literal["other mode", "free motion"]
    motion: Literal["turn", "shift"]
    axis: tuple[float, float, float] = Field(description="Direction in the mesh's frame.")
    extent: float = Field(description="Radians or metres.")


class CheckOut(BaseModel):
    """What depth that the snap did not read says of its result."""

    pixels: int = Field(description="Within the object's outline; 0 where none was left to check by.")
    seen: float = Field(description="Share of them that was measured and is not hidden.")
    match: float = Field(description="Share of the seen ones, like `behind` and `before`.")
    behind: float = Field(description="Depth lies clearly behind the object.")
    behind_by: float = Field(description="Metres.")
    before: float = Field(description="Depth lies clearly before the object.")
    before_by: float = Field(description="Metres.")


class CertificatesOut(BaseModel):
    """What speaks for an estimate beside its confidence."""

    observably_correct: bool = Field(description="Depth that the snap did not read agrees with it.")
    non_degenerate: bool = Field(description="No other pose fits as well, symmetric twins aside.")
    check: CheckOut
    unused: list[CheckOut] = Field(description="What each frame says that was not used.")


class KnownObjectOut(BaseModel):
    """Another object, which hid what was behind it and attracted nothing."""

    registration_id: int
    object_id: int
    T_world_object: Pose


class FrameCheckOut(BaseModel):
    """What a frame says of a pose that was found without it."""

    frame_id: int
    share: float | None = Field(
        description="Of the object's pixels that are seen, of those that match; null where too few are "
        "seen to tell."
    )
    agrees: bool | None


class EstimateOut(BaseModel):
    """What a snap found."""

    frame_id: int
    T_world_object: Pose
    T_camera_object: Pose
    confidence: float = Field(description="As computed; `assessment` has it as the dataset taught it.")
    covariance: list[list[float]]
    hypotheses: list[HypothesisOut]
    ambiguities: list[AmbiguityOut] | None = Field(
        description="What depth does not tell about the pose; null where an older version did not say."
    )
    certificates: CertificatesOut | None = Field(description="Null where an older version had none.")
    assessment: AssessmentOut | None = Field(
        description="What the operator was told; null where an older version told nothing."
    )
    converged: bool
    seed: int
    method: Method
    config: dict[str, Any]
    start_spread: list[float] | None
    known_objects: list[KnownObjectOut] | None = Field(
        description="Objects of the scene that the snap knew; null where an older version did not say."
    )
    symmetries_version: int | None = Field(
        description="Of the object's symmetries; null where an older version did not keep it."
    )
    used_frames: list[int] | None = Field(
        description="Frames that it was found in, best first; null where an older version did not say: one."
    )
    other_frames: list[FrameCheckOut] | None = Field(
        description="What frames that were not used say of it; null where an older version did not ask."
    )
    version: str
    algorithm: str | None = Field(
        description="A hash of the sources and fitted numbers that computed it: with the same one, inputs "
        "and seed the result is the same on one machine; null where an older version did not say."
    )
    hardware: str
    seconds: float
    evaluations: int


class SnapDetail(BaseModel):
    """How a snap stands."""

    id: str
    registration_id: int
    state: SnapState
    progress: float
    message: str | None
    standing: Standing | None
    """While it waits or runs."""
    withheld: str | None = Field(description="Why its result was only offered.")
    estimate: EstimateOut | None


@router.post("/registrations/{registration_id}/snaps", status_code=202)
def request_snap(
    live_session: LiveSessionDep, services: ServicesDep, identity: AnyoneDep, body: NewSnap | None = None
) -> SnapDetail:
    """Ask the machine for a better pose from the present one."""
    wanted = body or NewSnap(seed=None, config=None, frames=None)
    try:
        config = SnapConfig.from_dict({"preset": live_session.session.method, **(wanted.config or {})})
    except ValueError as error:
        raise InputError(f"body.{error}.") from error
    given = "start_spread" in wanted.model_fields_set
    spread = wanted.start_spread if given else Unsaid.FROM_DRAGS
    frames = tuple(dict.fromkeys(wanted.frames)) if isinstance(wanted.frames, list) else wanted.frames
    if config.method == "particle_filter" and isinstance(frames, tuple) and len(frames) > 1:
        raise InputError("body.frames must name one frame: the paper's filter knows one view.")
    snap_id = live_session.session.snap(identity.actor, config, wanted.seed, spread, frames)
    return get_snap(snap_id, services, identity)


@router.get("/snaps/{snap_id}")
def get_snap(snap_id: str, services: ServicesDep, identity: AnyoneDep) -> SnapDetail:
    """How a snap stands, with its estimate when it is done."""
    registration_id = _events(services, identity, snap_id)[0].registration_id
    # Before the log: how this one ended is there by now.
    now = services.live_sessions.live_state(registration_id)
    live = now.snap if now else None
    outcome = next((event for event in services.log.snap_events(snap_id) if event.kind in OUTCOMES), None)
    if outcome is not None:
        estimate = services.log.estimate(snap_id)
        return SnapDetail(
            id=snap_id,
            registration_id=registration_id,
            state=OUTCOMES[outcome.kind],
            progress=1.0 if estimate else 0.0,
            message=outcome.detail.get("message"),
            standing=None,
            withheld=outcome.detail.get("withheld"),
            estimate=_estimate_out(estimate) if estimate else None,
        )
    if live is not None and live.id == snap_id:
        state = cast(SnapState, live.state)  # "failed" where the outcome could not be saved
        standing = services.snapper.standing(snap_id)
        return _without_outcome(snap_id, registration_id, state, live.progress, live.message, standing)
    return _without_outcome(snap_id, registration_id, "failed", 0.0, INTERRUPTED)


@router.delete("/snaps/{snap_id}")
def cancel_snap(snap_id: str, services: ServicesDep, identity: AnyoneDep) -> SnapDetail:
    """Cancel a snap of mine; one that has ended stays as it is."""
    registration_id = _events(services, identity, snap_id)[0].registration_id
    session = services.live_sessions.open(registration_id, identity).session
    live = session.snapshot().snap
    if live is not None and live.id == snap_id:
        session.cancel_snap(identity.actor)
    return get_snap(snap_id, services, identity)


def _events(services: Services, identity: Identity, snap_id: str) -> list[Event]:
    events = list(services.log.snap_events(snap_id))
    if not events or events[0].kind == "search_requested":
        raise HTTPException(404, f"There is no snap {snap_id}.")
    services.live_sessions.check_readable(events[0].registration_id, identity)
    return events


def _without_outcome(
    snap_id: str,
    registration_id: int,
    state: SnapState,
    progress: float,
    message: str | None,
    standing: Standing | None = None,
) -> SnapDetail:
    return SnapDetail(
        id=snap_id,
        registration_id=registration_id,
        state=state,
        progress=progress,
        message=message,
        standing=standing,
        withheld=None,
        estimate=None,
    )


def _estimate_out(row: EstimateRow) -> EstimateOut:
    stored = {name: getattr(row, name) for name in EstimateOut.model_fields if name != "method"}
    return EstimateOut(method=method_of(row.config), **stored)
