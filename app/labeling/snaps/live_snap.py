"""Live snapping: the machine looks where a snap from the newest pose would land, one look at a time."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from app.labeling.moves.pose_record import Array
from app.labeling.snaps.request import Request, Submit
from app.labeling.snaps.snap_exchange import Offer, SnapFailure, SnapOrder, SnapResult, SnapStatus
from app.storage.roles import Actor


@dataclass(frozen=True)
class Look:
    """What one look found, and from where."""

    order: SnapOrder
    result: SnapResult

    @property
    def offer(self) -> Offer:
        """As it is shown."""
        order, result = self.order, self.result
        return Offer(
            order.snap_id, order.T_world_object, result.T_world_object, result.assessment, quiet=True
        )


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
        self.found: Look | None = None

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

        def settle(outcome: SnapResult | SnapFailure) -> None:
            self.found = None if isinstance(outcome, SnapFailure) else Look(sought, outcome)

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
