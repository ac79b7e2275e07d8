"""What a session has asked the workers for, and how that stands until it ends or nobody waits for it."""

from collections.abc import Callable
from dataclasses import replace
from typing import Generic, TypeVar

from app.labeling.snaps.snap_exchange import FramesReport, SnapStatus
from app.storage.faults import told
from app.workers.pool import SnapError

Order = TypeVar("Order")
Result = TypeVar("Result")

Submit = Callable[[Order, Callable[[float], None], Callable[[Result | SnapError], None]], Callable[[], None]]
"""Hands an order to the workers, and returns a function that cancels it. Unless that is called, the first
function gets shares in [0, 1], and the second is called once with the end; both from any thread."""


class Request(Generic[Order, Result]):
    """The newest order of its kind; an older one brings nothing any more. Whoever calls it holds the session.

    Args:
        submit: Hands an order to the workers.
        brings: What is lost where a result cannot be written down, in words.
    """

    def __init__(self, submit: Submit[Order, Result], brings: str) -> None:
        self._submit = submit
        self._brings = brings
        self._order: Order | None = None
        """The one that is under way."""
        self._cancel: Callable[[], None] = _nothing
        self.status: SnapStatus | None = None
        """Of the last one."""

    @property
    def is_under_way(self) -> bool:
        """Whether a result may still come."""
        return self._order is not None

    def start(
        self,
        order: Order,
        status: SnapStatus,
        settle: Callable[[Result | SnapError], FramesReport | None],
    ) -> None:
        """Submit an order, in the place of one that is under way.

        Args:
            order: What is asked for.
            status: How it stands at first.
            settle: Writes its end down, before it is told; returns what frames had to do with it.
        """
        self.drop()
        self._order, self.status = order, status

        def progressed(share: float) -> None:
            if self._order is order:
                progress = max(self._status.progress, min(1.0, share))
                self.status = replace(self._status, state="running", progress=progress)

        def ended(outcome: Result | SnapError) -> None:
            if self._order is not order:
                return
            self._order, self._cancel = None, _nothing
            failed = isinstance(outcome, SnapError)
            try:
                frames = settle(outcome)
            except Exception as error:
                message = f"The {self._brings} could not be saved: {told(error)}."
                self.status = replace(self._status, state="failed", message=message)
                raise
            if failed:
                self.status = replace(self._status, state="failed", message=str(outcome))
            else:
                self.status = replace(self._status, state="done", progress=1.0, frames=frames)

        cancel = self._submit(order, progressed, ended)
        if self._order is order:  # else it has ended already
            self._cancel = cancel

    def abandon(self, write_down: Callable[[str], object]) -> None:
        """Stop the one that is under way, whose id is written down first; without one nothing happens."""
        if self._order is None:
            return
        write_down(self._status.id)
        self.drop()
        self.status = replace(self._status, state="cancelled")

    def drop(self) -> None:
        """Let go of the one that is under way, without a word."""
        cancel, self._cancel, self._order = self._cancel, _nothing, None
        cancel()

    @property
    def _status(self) -> SnapStatus:
        assert self.status is not None
        return self.status


def _nothing() -> None:
    """Cancels what is not under way."""
