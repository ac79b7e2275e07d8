"""Tells where the camera of a 3-D view came to: seldom, and never in the way of a drag."""

import logging
import threading
import time
from collections.abc import Callable

logger = logging.getLogger(__name__)

SECONDS_BETWEEN_LOOKS = 1.0
"""A camera that moves is told of no more often, and where it came to rest is told that much later at most."""

Camera = dict[str, list[float] | float]
"""In the world, metres: `position`, `look_at`, which it turns about, and `up`; `fov`, vertical, radians."""


class CameraWatch:
    """Follows one camera.

    Args:
        tell: Called from a thread of its own with where the camera is, and for how many seconds it moved.
    """

    def __init__(self, tell: Callable[[Camera, float], None]) -> None:
        self._tell = tell
        self._lock = threading.Lock()
        self._newest: Camera = {}
        self._told: Camera = {}
        self._timer: threading.Timer | None = None
        self._closed = False

    def moved(self, camera: Camera) -> None:
        """The camera is here now; quick."""
        with self._lock:
            self._newest = camera
            if camera == self._told or self._timer is not None or self._closed:
                return
            self._timer = threading.Timer(SECONDS_BETWEEN_LOOKS, self._look, [time.monotonic()])
            self._timer.daemon = True
            self._timer.start()

    def close(self) -> None:
        """Tell nothing more."""
        with self._lock:
            self._closed, timer = True, self._timer
        if timer is not None:
            timer.cancel()
            timer.join()

    def _look(self, began: float) -> None:
        with self._lock:
            self._timer = None
            told, newest, self._told = self._told, self._newest, self._newest
            if self._closed or newest == told:
                return
        try:
            self._tell(newest, time.monotonic() - began)
        except Exception:
            logger.exception("Where an operator looks from could not be written down")
