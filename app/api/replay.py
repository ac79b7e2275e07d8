"""Replays: a registration's log as a time line, and the 3-D view of what there was to see at any time."""

from typing import Annotated

import numpy as np
from fastapi import APIRouter, Depends
from pydantic import BaseModel, Field

from app.analysis.trace.pose_errors import PoseErrors, pose_errors
from app.analysis.trace.trace import SAMPLE_SECONDS, Trace
from app.api.dependencies import Id, IdentityDep, ServicesDep
from app.api.registration_state import AssessmentOut, assessment_out
from app.api.tasks import Named
from app.confidence.assessment import Assessed, Assessment
from app.labeling.moves.history import PosedBy
from app.labeling.snaps.snap_exchange import FramesReport
from app.replay.recording import Recording, ShownEvent
from app.replay.replays import Replay
from app.storage.tables import Method, Pose
from app.workers.methods import method_of
from registration_core import ObjectModel
from registration_core.geometry import pose

router = APIRouter(prefix="/api/registrations", tags=["replay"])

MOST_SAMPLES = 1000
"""Of the curve; long registrations are sampled more seldom than a trace for the study."""


class SpanOut(BaseModel):
    """A stretch of time."""

    start: float
    end: float


class TraceEvent(SpanOut):
    """An event on the time line; a snap's result begins when it was requested."""

    sequence: int
    kind: str
    actor: str
    snap_id: str | None
    dof: list[str] | None
    technique: str | None
    method: Method | None = Field(description="of a snap, what it was computed with")
    frames: FramesReport | None = Field(description="of the result of a snap, in how many it was found")
    confidence: float | None
    verdict: Assessed | None = Field(description="accept, look or doubt, as the operator was told")


class Curve(BaseModel):
    """How far the object was from its last pose."""

    seconds: list[float]
    translation: list[float] = Field(description="metres between the origins")
    rotation: list[float] = Field(description="radians, the least over the object's symmetries")


class TraceOut(BaseModel):
    """A registration over time; times are seconds since its first event."""

    registration_id: int
    task_id: int
    operator: Named
    state: str
    condition: str
    is_simulated: bool = Field(description="whether a script took the operator's part, in simulated time")
    seconds: float
    first_sight: float
    events: list[TraceEvent]
    idle: list[SpanOut]
    curve: Curve


class ReplayOut(BaseModel):
    """An open replay."""

    view_url: str


class NewMoment(BaseModel):
    """What is to be shown."""

    seconds: float = Field(ge=0, le=1e9)
    follow: bool = Field(True, description="Let the 3-D view be looked at as the operator did.")
    frame_id: int | None = Field(None, description="The frame to show; the operator's where left out.")


class GhostOut(BaseModel):
    """An estimate that stood in the view."""

    T_world_object: Pose
    confidence: float
    assessment: AssessmentOut | None
    on_offer: bool


class ToLast(BaseModel):
    """From a pose to the last one."""

    translation: float
    """Metres."""
    rotation: float
    """Radians, the least over the object's symmetries."""


class MomentOut(BaseModel):
    """What there was to see."""

    seconds: float
    T_world_object: Pose
    T_camera_object: Pose
    to_last: ToLast
    confidence: float | None
    assessment: AssessmentOut | None
    posed_by: PosedBy
    frame_id: int
    ghost: GhostOut | None


def my_replay(registration_id: Id, services: ServicesDep, identity: IdentityDep) -> Replay:
    """The caller's replay of a registration that they may read."""
    services.live_sessions.check_readable(registration_id, identity)
    return services.replays.get(registration_id, identity.user_id)


ReplayDep = Annotated[Replay, Depends(my_replay)]


@router.get("/{registration_id}/trace")
def get_trace(registration_id: Id, services: ServicesDep, identity: IdentityDep) -> TraceOut:
    """The time line of a registration: one's own, or anyone's for a reviewer."""
    services.live_sessions.check_readable(registration_id, identity)
    registration, recording = services.replays.recorded(registration_id)
    trace = recording.trace
    return TraceOut(
        registration_id=registration.id,
        task_id=registration.task_id,
        operator=Named(id=registration.user_id, name=registration.user.name),
        state=registration.state,
        condition=registration.task.condition,
        is_simulated=recording.is_simulated,
        seconds=trace.duration,
        first_sight=trace.first_sight,
        events=_events_out(recording),
        idle=[SpanOut(start=span.start, end=span.end) for span in trace.idle],
        curve=_curve(trace, services.replays.model(registration)),
    )


@router.post("/{registration_id}/replay")
def open_replay(registration_id: Id, services: ServicesDep, identity: IdentityDep) -> ReplayOut:
    """Open my replay of a registration, or bring it up to what the log holds by now."""
    services.live_sessions.check_readable(registration_id, identity)
    services.replays.open(registration_id, identity.user_id)
    return ReplayOut(view_url=f"/view/replay/{registration_id}/")


@router.put("/{registration_id}/replay")
def show_moment(body: NewMoment, services: ServicesDep, replay: ReplayDep) -> MomentOut:
    """Show, in the view of my replay, what there was to see at a time."""
    moment, frame = services.replays.show(replay, body.seconds, body.follow, body.frame_id)
    T_camera_object = pose.inverse(np.array(frame.T_world_camera)) @ moment.T_world_object
    translation, rotation = _to_last(replay.recording.trace, moment.T_world_object[None], replay.model)
    ghost = moment.ghost
    return MomentOut(
        seconds=body.seconds,
        T_world_object=moment.T_world_object.tolist(),
        T_camera_object=T_camera_object.tolist(),
        to_last=ToLast(translation=float(translation[0]), rotation=float(rotation[0])),
        confidence=moment.confidence,
        assessment=_assessment_out(moment.assessment),
        posed_by=moment.posed_by,
        frame_id=frame.id,
        ghost=None
        if ghost is None
        else GhostOut(
            T_world_object=ghost.T_world_object.tolist(),
            confidence=ghost.confidence,
            assessment=_assessment_out(ghost.assessment),
            on_offer=ghost.on_offer,
        ),
    )


def _events_out(recording: Recording) -> list[TraceEvent]:
    methods = {
        event.snap_id: method_of(event.detail["config"])
        for event in recording.events
        if event.kind == "snap_requested"
    }
    return [
        _event_out(sequence, event, SpanOut(start=span.start, end=span.end), methods.get(event.snap_id))
        for sequence, (event, span) in enumerate(
            zip(recording.events, recording.trace.spans, strict=True), start=1
        )
    ]


def _event_out(sequence: int, event: ShownEvent, span: SpanOut, method: Method | None) -> TraceEvent:
    return TraceEvent(
        **span.model_dump(),
        sequence=sequence,
        kind=event.kind,
        actor=event.actor,
        snap_id=event.snap_id,
        dof=event.dof,
        technique=event.detail.get("technique"),
        method=method,
        frames=_frames_out(event),
        confidence=event.detail.get("confidence"),
        verdict=event.detail.get("assessment", {}).get("verdict"),
    )


def _frames_out(event: ShownEvent) -> FramesReport | None:
    if event.kind not in ("snap_applied", "snap_offered") or "used_frames" not in event.detail:
        return None
    agrees = [one["agrees"] for one in event.detail["other_frames"] if one["agrees"] is not None]
    return FramesReport(used=len(event.detail["used_frames"]), agreeing=sum(agrees), asked=len(agrees))


def _to_last(trace: Trace, T_world_object: np.ndarray, model: ObjectModel) -> PoseErrors:
    return pose_errors(T_world_object, trace.T_world_object, model.symmetry_transforms)


def _curve(trace: Trace, model: ObjectModel) -> Curve:
    times = trace.sample_times(max(SAMPLE_SECONDS, trace.duration / MOST_SAMPLES))
    errors = _to_last(trace, trace.motion.at(times), model)
    return Curve(
        seconds=np.round(times, 3).tolist(),
        translation=np.round(errors.translation, 5).tolist(),
        rotation=np.round(errors.rotation, 5).tolist(),
    )


def _assessment_out(assessment: Assessment | None) -> AssessmentOut | None:
    return None if assessment is None else assessment_out(assessment)
