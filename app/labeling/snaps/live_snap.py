"""Live snapping: the machine looks where a snap from the newest pose would land, one look at a time."""

from collections.abc import Callable

import numpy as np

from app.labeling.moves.pose_record import Array
from app.labeling.snaps.request import Request, Submit
from app.labeling.snaps.snap_exchange import Offer, SnapOrder, SnapResult, SnapStatus
from app.storage.roles import Actor
from app.workers.pool import SnapError


class LiveSnap:
    """Follows the object while it is on; what it finds is shown, and kept only where it is accepted.

    Args:
        submit: Hands an order to the workers.
    """

    def __init__(self, submit: Submit[SnapOrder, SnapResult]) -> None:
        self._request = Request(submit, "look")
        self._sought: SnapOrder | None = None
        """The newest order."""
        self.is_on = False
        self.found: Offer | None = None
        """Where a snap would land."""

    def follow(self, T_world_object: Array, frame_id: int, order: Callable[[], SnapOrder]) -> None:
        """Look from this pose, unless a look is under way: its end is followed by another call of this.

        Args:
            T_world_object: Where the object is now.
            frame_id: The frame to snap against.
            order: Makes the order, where one is needed.
        """
        if not self.is_on or self._request.is_under_way or self._was_sought(T_world_object, frame_id):
            return
        sought = self._sought = order()

        def settle(outcome: SnapResult | SnapError) -> None:
            self.found = None if isinstance(outcome, SnapError) else Offer(sought, outcome, quiet=True)

        self._request.start(sought, SnapStatus(sought.snap_id, Actor.MACHINE), settle)

    def rest(self) -> None:
        """Show nothing, and let go of a look under way."""
        self._request.drop()
        self._sought = self.found = None

    def _was_sought(self, T_world_object: Array, frame_id: int) -> bool:
        sought = self._sought
        return (
            sought is not None
            and sought.frame_id == frame_id
            and np.array_equal(sought.T_world_object, T_world_object)
        )
