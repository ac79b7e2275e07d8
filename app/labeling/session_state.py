"""What a session tells of itself."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.confidence.assessment import Assessment
from app.labeling.layers import Layers
from app.labeling.moves.degrees_of_freedom import GizmoAxes
from app.labeling.moves.history import PosedBy
from app.labeling.snaps.snap_exchange import Offer, SnapStatus
from app.storage.tables import FrameUse, Method

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SessionState:
    """All that a page or a script may want to know of a session at one moment."""

    registration_id: int
    revision: int
    """Grows with every change, also when the session is opened anew: the larger state is the newer."""
    state: str
    skip_reason: str | None
    frame_id: int
    T_world_object: Array
    confidence: float | None
    assessment: Assessment | None
    """Of the estimate that the pose stems from."""
    posed_by: PosedBy
    can_undo: bool
    can_redo: bool
    dragging: bool
    gizmo_axes: GizmoAxes
    layers: Layers
    snap: SnapStatus | None
    offer: Offer | None
    method: Method
    """What Snap computes with."""
    frame_use: FrameUse
    """The frames that it uses."""
    is_live: bool
    live: Offer | None
    """Where a snap would land now."""
    estimate_snap_id: str | None
    """The snap that the pose stems from."""
    search: SnapStatus | None
    preview: Array | None
    """A pose T_world_object that the operator looks at before taking it."""
    message: str | None
