"""The 3-D view of a session: made where somebody wants to see it, and kept in step with the session since."""

from collections.abc import Callable

import numpy as np

from app.confidence.uncertainty import Uncertainty
from app.datasets.scene_data import SceneData
from app.labeling.layers import Layers
from app.labeling.live.coloring import Coloring
from app.labeling.live.live_session import LiveSession
from app.labeling.moves.camera_watch import CameraWatch
from app.labeling.session_state import SessionState
from app.storage.tables import Frame
from app.views3d.frame_view import first_view_of, show_cloud_of
from app.views3d.view import DragHandlers, SceneView

TellUncertainty = Callable[[str | None], Uncertainty | None]
"""Tells what is not known about a pose by the snap that it stems from."""


def view_of(live_session: LiveSession, data: SceneData, uncertainty: TellUncertainty) -> SceneView:
    """A new view of a session, whose gizmo moves the session's object."""
    session = live_session.session
    state = session.snapshot()
    frame = live_session.frames[state.frame_id]
    drag = DragHandlers(session.start_drag, session.drag_to, session.end_drag)
    first_view = first_view_of(frame, data.depth(frame))
    view = SceneView(
        live_session.model, state.T_world_object, first_view, drag, data.drawable, live_session.textured
    )
    view.watch_camera(CameraWatch(session.look_from))
    shown = _Shown(view, data, live_session.frames, uncertainty)
    shown.update(state)
    session.subscribe(shown.update)
    live_session.neighbours.subscribe(view.neighbours.show)
    coloring = Coloring(live_session.reading, view.show_on_object)
    coloring.update(state)
    session.subscribe(coloring.update)
    return view


class _Shown:
    """What a view shows by now."""

    def __init__(
        self, view: SceneView, data: SceneData, frames: dict[int, Frame], uncertainty: TellUncertainty
    ) -> None:
        self._view = view
        self._data = data
        self._frames = frames
        self._uncertainty = uncertainty
        self._frame_id: int | None = None
        self._locked = False
        self._ghost: np.ndarray | None = None
        self._snap_id: str | None = None
        self._layers = Layers()

    def update(self, state: SessionState) -> None:
        """Draw what changed."""
        if state.frame_id != self._frame_id:
            self._frame_id = state.frame_id
            frame = self._frames[state.frame_id]
            show_cloud_of(self._view, frame, self._data.cloud(frame))
        if not state.dragging:
            self._view.move_object(state.T_world_object, state.gizmo_axes)
        offer = state.live or state.offer
        ghost = state.preview if offer is None or state.preview is not None else offer.T_world_object
        if ghost is not self._ghost:
            self._ghost = ghost
            self._view.show_ghost(ghost)
        if state.estimate_snap_id != self._snap_id:
            self._snap_id = state.estimate_snap_id
            self._view.uncertainty.show(self._uncertainty(self._snap_id))
        locked = state.state != "open"
        if locked is not self._locked:
            self._locked = locked
            self._view.lock_object(locked)
        if state.layers != self._layers:
            self._layers = state.layers
            self._view.show_layers(state.layers)
