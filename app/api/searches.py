"""Finding an object without a start: asking for it, how that stands, and looking at a candidate."""

from typing import Annotated, Any, cast

from fastapi import APIRouter, HTTPException
from pydantic import BaseModel, Field

from app.access.auth import Identity
from app.api.dependencies import EXAMPLE_POSE, AnyoneDep, LiveSessionDep, ServicesDep, rigid_pose
from app.api.problems import InputError
from app.api.registration_state import RegistrationOut, registration_out
from app.api.snaps import INTERRUPTED, HypothesisOut, KnownObjectOut, SnapState
from app.datasets.scene_data import camera_of
from app.services import Services
from app.storage.tables import Event, Pose
from registration_core import SnapConfig
from registration_core.propose import checked_region

router = APIRouter(prefix="/api", tags=["searches"])

OUTCOMES: dict[str, SnapState] = {
    "search_done": "done",
    "search_cancelled": "cancelled",
    "search_failed": "failed",
}

Pixels = Annotated[int, Field(ge=-(10**6), le=10**6)]


class NewSearch(BaseModel):
    """Where and how to look; everything has a default."""

    region: tuple[Pixels, Pixels, Pixels, Pixels] | None = Field(
        None, description="Left, top, width and height in pixels; left out, the whole image.", examples=[None]
    )
    seed: int | None = Field(None, ge=0, lt=2**63, description="For a result that can be repeated.")
    config: dict[str, Any] | None = Field(
        None, description="Changes to the default configuration.", examples=[{}]
    )


class SearchId(BaseModel):
    """The search that was begun."""

    id: str


class SearchDetail(BaseModel):
    """How a search stands."""

    id: str
    registration_id: int
    frame_id: int
    state: SnapState
    message: str | None
    candidates: list[HypothesisOut] = Field(description="Best first; none where nothing fits, or not yet.")
    seed: int
    config: dict[str, Any]
    region: list[int] | None
    known_objects: list[KnownObjectOut] = Field(
        description="What was known of the scene: its depth was passed by."
    )
    seconds: float | None


class Preview(BaseModel):
    """A pose to look at."""

    T_world_object: Pose | None = Field(examples=[EXAMPLE_POSE])


@router.post("/registrations/{registration_id}/searches", status_code=202)
def request_search(
    live_session: LiveSessionDep, identity: AnyoneDep, body: NewSearch | None = None
) -> SearchId:
    """Ask the machine where in the frame the object may be."""
    wanted = body or NewSearch(region=None, seed=None, config=None)
    session = live_session.session
    try:
        config = SnapConfig.from_dict(wanted.config or {})
        checked_region(wanted.region, camera_of(live_session.frames[session.snapshot().frame_id]))
    except ValueError as error:
        raise InputError(f"body.{error}.") from error
    return SearchId(id=session.search(identity.actor, wanted.region, config, wanted.seed))


@router.get("/searches/{search_id}")
def get_search(search_id: str, services: ServicesDep, identity: AnyoneDep) -> SearchDetail:
    """How a search stands, with its candidates when it is done."""
    registration_id = _events(services, identity, search_id)[0].registration_id
    # Before the log: how this one ended is there by now.
    now = services.live_sessions.live_state(registration_id)
    live = now.search if now else None
    requested, *rest = _events(services, identity, search_id)
    outcome = rest[0] if rest else None
    detail = outcome.detail if outcome else {}
    if outcome is not None:
        state, message = OUTCOMES[outcome.kind], detail.get("message")
    elif live is not None and live.id == search_id:
        state, message = cast(SnapState, live.state), live.message
    else:
        state, message = "failed", INTERRUPTED
    return SearchDetail(
        id=search_id,
        registration_id=registration_id,
        frame_id=requested.detail["frame_id"],
        state=state,
        message=message,
        candidates=[HypothesisOut(**candidate) for candidate in detail.get("candidates", [])],
        seed=requested.detail["seed"],
        config=requested.detail["config"],
        region=requested.detail["region"],
        known_objects=requested.detail.get("known_objects", []),
        seconds=outcome.duration_seconds if outcome else None,
    )


@router.delete("/searches/{search_id}")
def leave_search(search_id: str, services: ServicesDep, identity: AnyoneDep) -> SearchDetail:
    """Cancel a search of mine, or put its candidates away; in the log they stay."""
    registration_id = _events(services, identity, search_id)[0].registration_id
    session = services.live_sessions.open(registration_id, identity).session
    live = session.snapshot().search
    if live is not None and live.id == search_id:
        session.leave_search(identity.actor)
    return get_search(search_id, services, identity)


@router.put("/registrations/{registration_id}/preview")
def preview(body: Preview, live_session: LiveSessionDep) -> RegistrationOut:
    """Show a pose as a ghost, without moving the object; null shows nothing."""
    T = body.T_world_object
    live_session.session.preview(None if T is None else rigid_pose(T, "T_world_object"))
    return registration_out(live_session)


def _events(services: Services, identity: Identity, search_id: str) -> list[Event]:
    events = [event for event in services.log.snap_events(search_id) if event.kind.startswith("search_")]
    if not events:
        raise HTTPException(404, f"There is no search {search_id}.")
    services.live_sessions.check_readable(events[0].registration_id, identity)
    return events
