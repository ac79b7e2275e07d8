"""Live snapping: the machine looks where a snap from the newest pose would land, one look at a time."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from app.labeling.moves.pose_record import Array
from app.labeling.snaps.snap_exchange import Offer, RequestSnap, SnapFailure, SnapOrder, SnapResult


@dataclass(frozen=True)
class Look:
    """What one look found, and from where."""

    order: SnapOrder
    result: SnapResult
    offer: Offer


class LiveSnap:
    """Follows the object while it is on; what it finds is shown, and kept only where it is accepted.

    Args:
        request_snap: Hands an order to the workers.
    """

    def __init__(self, request_snap: RequestSnap) -> None:
        self._request_snap = request_snap
        self._sought: SnapOrder | None = None
        """The newest order."""
        self._cancel: Callable[[], None] | None = None
        """Ends the one that is under way."""
        self.is_on = False
        self.found: Look | None = None

    def follow(self, T_world_object: Array, frame_id: int, order: Callable[[], SnapOrder]) -> None:
        """Look from this pose, unless a look is under way: its end is followed by another call of this.

        Args:
            T_world_object: Where the object is now.
            frame_id: The frame to snap against.
            order: Makes the order, where one is needed.
        """
        if not self.is_on or self._cancel is not None or self._was_sought(T_world_object, frame_id):
            return
        sought = self._sought = order()
        self._cancel = _nothing
        cancel = self._request_snap(sought, lambda share: None, lambda outcome: self._ended(sought, outcome))
        if self._cancel is not None:  # else it has ended already
            self._cancel = cancel

    def rest(self) -> None:
        """Show nothing, and let go of a look under way."""
        if self._cancel is not None:
            self._cancel()
        self._cancel = self._sought = self.found = None

    def _was_sought(self, T_world_object: Array, frame_id: int) -> bool:
        sought = self._sought
        return (
            sought is not None
            and sought.frame_id == frame_id
            and np.array_equal(sought.T_world_object, T_world_object)
        )

    def _ended(self, order: SnapOrder, outcome: SnapResult | SnapFailure) -> None:
        if order is not self._sought:
            return
        self._cancel = None
        if isinstance(outcome, SnapFailure):
            self.found = None
        else:
            offer = _offer(order, outcome)
            self.found = Look(order, outcome, offer)


def _offer(order: SnapOrder, result: SnapResult) -> Offer:
    return Offer(order.snap_id, order.T_world_object, result.T_world_object, result.assessment, quiet=True)


def _nothing() -> None:
    """Cancels what has not begun."""
