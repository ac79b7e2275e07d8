"""Finding the object without a start: the search that was asked for, and how it stands."""

import secrets
import uuid
from collections.abc import Callable, Collection
from dataclasses import dataclass

from app import __version__
from app.labeling.moves.permissions import Tool, require
from app.labeling.moves.pose_record import PoseRecord
from app.labeling.scene.known_object import KnownObject
from app.labeling.snaps.request import Request, Submit
from app.labeling.snaps.snap_exchange import SnapStatus, stored_known
from app.storage.event_log import NewEvent
from app.storage.roles import Actor
from app.workers.jobs import Proposals
from app.workers.pool import SnapError
from registration_core import SnapConfig

Region = tuple[int, int, int, int]
"""(left, top, width, height), pixels."""


@dataclass(frozen=True)
class SearchOrder:
    """What a search is to look at."""

    search_id: str
    frame_id: int
    region: Region | None
    """Where to look; everywhere where it is None."""
    config: SnapConfig
    seed: int
    known: tuple[KnownObject, ...] = ()
    """Other objects, whose depth is passed by."""


class Search:
    """The newest search of a session, which lets nobody in while somebody else is.

    Args:
        record: Where it is written down.
        tools: What may be used on this task.
        submit: Hands an order to the workers.
        known_objects: Tells what is known of other objects in the scene.
    """

    def __init__(
        self,
        record: PoseRecord,
        tools: Collection[Tool],
        submit: Submit[SearchOrder, Proposals],
        known_objects: Callable[[], tuple[KnownObject, ...]],
    ) -> None:
        self._record = record
        self._tools = tools
        self._known_objects = known_objects
        self._request = Request(submit, "candidates")

    @property
    def status(self) -> SnapStatus | None:
        """Of the last search; None once its candidates were taken or put away."""
        return self._request.status

    def start(self, actor: Actor, region: Region | None, config: SnapConfig, seed: int | None) -> str:
        """Look for the object; returns the search's id. See `LabelingSession.search`."""
        require(self._tools, "find it")
        order = SearchOrder(
            search_id=uuid.uuid4().hex,
            frame_id=self._record.frame_id,
            region=region,
            config=config,
            seed=secrets.randbelow(2**31) if seed is None else seed,
            known=self._known_objects(),
        )
        self.abandon(actor, "superseded")
        detail = {
            "seed": order.seed,
            "config": order.config.to_dict(),
            "region": None if order.region is None else list(order.region),
            "frame_id": order.frame_id,
            "known_objects": stored_known(order.known),
        }
        self._record.record(NewEvent("search_requested", actor, snap_id=order.search_id, detail=detail))

        def settle(outcome: Proposals | SnapError) -> None:
            self._record.record(_outcome_event(order, outcome))

        self._request.start(order, SnapStatus(order.search_id, actor), settle)
        return order.search_id

    def abandon(self, actor: Actor, reason: str) -> None:
        """Stop the search that is under way; nothing happens where there is none."""
        detail = {"reason": reason}
        self._request.abandon(
            lambda search_id: self._record.record(
                NewEvent("search_cancelled", actor, snap_id=search_id, detail=detail)
            )
        )

    def put_away(self) -> None:
        """Forget the candidates of a search that has ended."""
        if not self._request.is_under_way:
            self._request.status = None


def _outcome_event(order: SearchOrder, outcome: Proposals | SnapError) -> NewEvent:
    if isinstance(outcome, SnapError):
        detail = {"message": str(outcome)}
        return NewEvent("search_failed", Actor.MACHINE, snap_id=order.search_id, detail=detail)
    return NewEvent(
        kind="search_done",
        actor=Actor.MACHINE,
        snap_id=order.search_id,
        duration_seconds=outcome.seconds,
        detail={
            "candidates": [
                {
                    "T_camera_object": candidate.T_camera_object.tolist(),
                    "weight": candidate.weight,
                    "chance": candidate.chance,
                }
                for candidate in outcome.hypotheses
            ],
            "version": __version__,
            "algorithm": outcome.algorithm,
            "hardware": outcome.hardware,
        },
    )
