"""Keeps the colours of depth agreement in the 3-D view up to date, beside the drag and never in its way."""

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from app.labeling.scene.depth_reading import DepthReading
from app.labeling.session_state import SessionState
from registration_core.rendering.depth_verdicts import Verdict

SECONDS_BETWEEN = 0.1
MOST_POINTS = 4_000
"""So that a message to the page stays small."""
COLORS = {
    Verdict.NO_DATA: (92, 98, 108),
    Verdict.MATCH: (38, 173, 140),
    Verdict.IN_FRONT: (255, 233, 72),
    Verdict.BEHIND: (151, 84, 255),
}
"""Of different lightness each; the same in the page's style sheet."""

ShowPoints = Callable[[NDArray[np.float64], NDArray[np.uint8]], None]
"""Shows points (N, 3) in the object's frame, metres, in colours (N, 3); none where N is 0."""


class Coloring:
    """Draws the newest state only, and pauses after each time."""

    def __init__(self, reading: DepthReading, show: ShowPoints) -> None:
        self._reading = reading
        self._show = show
        self._thread = ThreadPoolExecutor(1, "coloring")
        self._newest: SessionState | None = None
        self._drawn: object = None
        self._is_waiting = False

    def update(self, state: SessionState) -> None:
        """Draw this state soon."""
        if not state.layers.agreement and self._newest is None:
            return
        self._newest = state
        if not self._is_waiting:
            self._is_waiting = True
            self._thread.submit(self._draw_newest)

    def _draw_newest(self) -> None:
        self._is_waiting = False
        state = self._newest
        assert state is not None
        content = (state.frame_id, state.T_world_object.tobytes()) if state.layers.agreement else None
        if content == self._drawn:
            return
        self._drawn = content
        self._show(*(self._points(state) if content else (np.empty((0, 3)), np.empty((0, 3), np.uint8))))
        time.sleep(SECONDS_BETWEEN)

    def _points(self, state: SessionState) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
        points = self._reading.surface(state.frame_id, state.T_world_object)
        verdicts = self._reading.of(state.frame_id, state.T_world_object).verdicts
        evenly = np.linspace(0, len(points) - 1, min(len(points), MOST_POINTS)).astype(np.intp)
        palette = np.array([COLORS[verdict] for verdict in Verdict], dtype=np.uint8)
        return points[evenly], palette[verdicts[evenly]]
