"""A live session as JSON: what a page or a script may know of a registration at one moment."""

import numpy as np
from pydantic import BaseModel, Field

from app.confidence.assessment import Assessed, Assessment
from app.labeling.layers import Layers
from app.labeling.live.live_session import LiveSession
from app.labeling.moves.degrees_of_freedom import GizmoAxes
from app.labeling.moves.history import PosedBy
from app.labeling.moves.permissions import Tool
from app.labeling.session_state import SessionState
from app.labeling.snaps.snap_exchange import SnapStatus
from app.storage.tables import FrameUse, Method, Pose
from registration_core.geometry import pose
from registration_core.rendering.depth_verdicts import Verdict


class AssessmentOut(BaseModel):
    """What is to be thought of an estimate."""

    verdict: Assessed
    reasons: list[str] = Field(description="In words, the weightiest first.")
    confidence: float = Field(description="After what the dataset's registrations have taught.")
    risk: float = Field(description="Share of wrong poses among the accepted that the dataset allows.")
    threshold: float | None = Field(
        description="The confidence from which on that holds; null where none is known."
    )


class OfferOut(BaseModel):
    """A pose that the machine offers."""

    snap_id: str
    T_world_object: Pose
    confidence: float
    assessment: AssessmentOut
    quiet: bool = Field(description="Nobody asked for it: it can be taken, and asks for no answer.")
    withheld: str | None = Field(description="Why the object was not put there.")


class LiveOut(BaseModel):
    """Where a snap would land now."""

    T_world_object_start: Pose = Field(description="The pose that it would start from.")
    T_world_object: Pose
    confidence: float
    assessment: AssessmentOut


class SearchOut(BaseModel):
    """The last search of a registration, until its candidates are taken or put away."""

    id: str
    state: str
    message: str | None


class AgreementOut(BaseModel):
    """How well the shown frame's depth agrees with the object where it is now."""

    inlier_share: float | None = Field(
        description="Matches among the pixels with depth that nothing hides; null where these are too few."
    )
    median_residual: float | None = Field(description="Of the matches, metres, without sign.")
    match: float = Field(description="Like the three below a share of the object's visible surface.")
    in_front: float = Field(description="The object is nearer than what was measured.")
    behind: float = Field(description="The object is farther away than what was measured.")
    no_data: float


class RegistrationOut(BaseModel):
    """One operator's work on one task, now."""

    id: int
    revision: int = Field(description="Grows with every change: of two states the larger is the newer.")
    task_id: int
    condition: str
    tools: list[Tool]
    """What may be used beside the gizmo, undo and the views."""
    method: Method
    """What Snap computes with where it is not asked otherwise."""
    methods: list[Method]
    """What it may compute with."""
    frame_use: FrameUse
    """The frames that Snap uses where it is not asked otherwise."""
    frame_uses: list[FrameUse]
    """Those that it may use."""
    state: str
    skip_reason: str | None
    frame_id: int
    T_world_object: Pose
    T_camera_object: Pose
    confidence: float | None
    assessment: AssessmentOut | None
    """What is to be thought of the estimate that the pose stems from."""
    posed_by: PosedBy = Field(description="Whose the pose is: start where the object began.")
    can_undo: bool
    can_redo: bool
    dragging: bool
    gizmo_axes: GizmoAxes
    """Along which the gizmo's arrows lie."""
    layers: Layers
    """What the 3-D view shows."""
    has_texture: bool = Field(description="Whether the mesh has colours of its own to be shown in.")
    agreement: AgreementOut | None
    """Nothing where no part of the object is in the frame, or the task is done without it."""
    saved: bool
    """Whether all of it is on the disk: a drag is when it ends."""
    snap: SnapStatus | None
    offer: OfferOut | None
    is_live: bool
    live: LiveOut | None
    symmetries_version: int = Field(description="Of the object's symmetries, which the next snap uses.")
    estimate_snap_id: str | None = Field(description="The snap that the pose stems from.")
    search: SearchOut | None
    preview: Pose | None = Field(description="T_world_object that is looked at before it is taken.")
    message: str | None
    view_url: str
    view_open: bool
    """Whether a page is connected to the 3-D view."""
    others: list[str] = Field(
        description="Names of other operators who have this task open in a page now; none in a study."
    )


def registration_out(live_session: LiveSession) -> RegistrationOut:
    """A live session as JSON."""
    state = live_session.session.snapshot()
    T_world_camera = np.array(live_session.frames[state.frame_id].T_world_camera)
    return RegistrationOut(
        id=state.registration_id,
        revision=state.revision,
        task_id=live_session.registration.task_id,
        condition=live_session.registration.task.condition,
        tools=sorted(live_session.session.tools),
        method=state.method,
        methods=list(live_session.session.methods),
        frame_use=state.frame_use,
        frame_uses=list(live_session.session.frame_uses),
        state=state.state,
        skip_reason=state.skip_reason,
        frame_id=state.frame_id,
        T_world_object=state.T_world_object.tolist(),
        T_camera_object=(pose.inverse(T_world_camera) @ state.T_world_object).tolist(),
        confidence=state.confidence,
        assessment=None if state.assessment is None else assessment_out(state.assessment),
        posed_by=state.posed_by,
        can_undo=state.can_undo,
        can_redo=state.can_redo,
        dragging=state.dragging,
        gizmo_axes=state.gizmo_axes,
        layers=state.layers,
        has_texture=live_session.textured is not None,
        agreement=_agreement_out(live_session, state),
        saved=not state.dragging,
        snap=state.snap,
        offer=_offer_out(state),
        is_live=state.is_live,
        live=_live_out(state),
        symmetries_version=live_session.object.present.symmetries_version,
        estimate_snap_id=state.estimate_snap_id,
        search=_search_out(state),
        preview=None if state.preview is None else state.preview.tolist(),
        message=state.message,
        view_url=f"/view/{state.registration_id}/",
        view_open=live_session.viewers > 0,
        others=list(live_session.others()),
    )


def assessment_out(assessment: Assessment) -> AssessmentOut:
    """An assessment as JSON."""
    return AssessmentOut(**assessment.stored())


def _agreement_out(live_session: LiveSession, state: SessionState) -> AgreementOut | None:
    if "agreement" not in live_session.session.tools:
        return None
    agreement = live_session.reading.of(state.frame_id, state.T_world_object)
    if not len(agreement.verdicts):
        return None
    return AgreementOut(
        inlier_share=agreement.inlier_share,
        median_residual=agreement.median_residual,
        match=agreement.share(Verdict.MATCH),
        in_front=agreement.share(Verdict.IN_FRONT),
        behind=agreement.share(Verdict.BEHIND),
        no_data=agreement.share(Verdict.NO_DATA),
    )


def _offer_out(state: SessionState) -> OfferOut | None:
    offer = state.offer
    if offer is None:
        return None
    return OfferOut(
        snap_id=offer.snap_id,
        T_world_object=offer.T_world_object.tolist(),
        confidence=offer.assessment.confidence,
        assessment=assessment_out(offer.assessment),
        quiet=offer.quiet,
        withheld=offer.withheld,
    )


def _live_out(state: SessionState) -> LiveOut | None:
    live = state.live
    if live is None:
        return None
    return LiveOut(
        T_world_object_start=live.order.T_world_object.tolist(),
        T_world_object=live.T_world_object.tolist(),
        confidence=live.assessment.confidence,
        assessment=assessment_out(live.assessment),
    )


def _search_out(state: SessionState) -> SearchOut | None:
    search = state.search
    return SearchOut(id=search.id, state=search.state, message=search.message) if search else None
