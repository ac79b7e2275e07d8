"""What a session and the machine tell each other about a snap."""

from dataclasses import asdict, dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from app import __version__
from app.confidence.assessment import Assessment
from app.labeling.moves.permissions import Wanted
from app.labeling.scene.known_object import KnownObject
from app.labeling.snaps.start_spread import StartSpread
from app.storage.roles import Actor
from app.storage.tables import EstimateRow, Method
from registration_core import Estimate, SnapConfig

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SnapFrames:
    """Ids of frames, best first."""

    used: tuple[int, ...]
    """The pose is looked for in these."""
    others: tuple[int, ...] = ()
    """They see the object, too: whether they agree speaks for the result, or against it."""


class ChooseFrames(Protocol):
    """Chooses the frames of a snap from a pose; `shown` is the frame that the operator looks at."""

    def __call__(
        self, shown: int, T_world_object: Array, known: tuple[KnownObject, ...], wanted: Wanted
    ) -> SnapFrames: ...


@dataclass(frozen=True)
class SnapOrder:
    """What a snap is to work on."""

    snap_id: str
    frame_id: int
    """The one that is shown."""
    frames: SnapFrames
    T_world_object: Array
    config: SnapConfig
    seed: int
    start_spread: StartSpread | None
    """How far off the pose may be; None where that is unknown."""
    known: tuple[KnownObject, ...] = ()
    is_live: bool = False
    """Nobody waits for it: others go first, and its progress is of no interest."""


@dataclass(frozen=True)
class SnapResult:
    """What a worker found."""

    estimate: Estimate
    T_world_object: Array
    symmetries_version: int
    """Of the object, that it was found with."""
    assessment: Assessment


@dataclass(frozen=True)
class FramesReport:
    """What frames had to do with a result."""

    used: int
    """So many it was found in."""
    agreeing: int
    """So many others agree with it, ..."""
    asked: int
    """... of those that see enough of the object to tell."""


@dataclass(frozen=True)
class SnapStatus:
    """How the last snap stands."""

    id: str
    asked_by: Actor
    state: str = "queued"
    """queued, running, done, cancelled or failed."""
    method: Method = "default"
    """What it is computed with."""
    progress: float = 0.0
    message: str | None = None
    frames: FramesReport | None = None
    """Once it is done."""

    @property
    def is_live(self) -> bool:
        """Whether it may still bring a result."""
        return self.state in {"queued", "running"}


@dataclass(frozen=True)
class Offer:
    """A result that waits for the operator's word."""

    order: SnapOrder
    result: SnapResult
    quiet: bool = False
    """Nobody asked for it: it is there to be taken, and asks for no answer."""
    withheld: str | None = None
    """Why the object was not put there."""

    @property
    def snap_id(self) -> str:
        """Of the snap that found it."""
        return self.order.snap_id

    @property
    def T_world_object(self) -> Array:
        """(4, 4), where the object would be put."""
        return self.result.T_world_object

    @property
    def assessment(self) -> Assessment:
        """What is to be thought of it."""
        return self.result.assessment


def stored_spread(spread: StartSpread | None) -> list[float] | None:
    """A spread as JSON keeps it."""
    return None if spread is None else list(spread)


def stored_known(known: tuple[KnownObject, ...]) -> list[dict[str, object]]:
    """Known objects as JSON keeps them: their registrations may be reopened later."""
    return [
        {
            "registration_id": one.registration_id,
            "object_id": one.object_id,
            "T_world_object": one.T_world_object.tolist(),
        }
        for one in known
    ]


def frames_report(order: SnapOrder, estimate: Estimate) -> FramesReport:
    """What frames had to do with an estimate, in numbers."""
    others = [check for check in estimate.certificates.unused if check.is_enough]
    return FramesReport(len(order.frames.used), sum(check.agrees for check in others), len(others))


def stored_others(order: SnapOrder, estimate: Estimate) -> list[dict[str, object]]:
    """What frames that were not used say of an estimate, as JSON keeps it; null where they cannot tell."""
    return [
        {
            "frame_id": frame_id,
            "share": check.match if check.is_enough else None,
            "agrees": check.agrees if check.is_enough else None,
        }
        for frame_id, check in zip(order.frames.others, estimate.certificates.unused, strict=True)
    ]


def estimate_row(registration_id: int, order: SnapOrder, result: SnapResult) -> EstimateRow:
    """A result as it is kept, with all that is needed to repeat it."""
    estimate = result.estimate
    return EstimateRow(
        snap_id=order.snap_id,
        registration_id=registration_id,
        frame_id=order.frame_id,
        T_world_object_start=order.T_world_object.tolist(),
        T_world_object=result.T_world_object.tolist(),
        T_camera_object=estimate.T_camera_object.tolist(),
        confidence=estimate.confidence,
        covariance=estimate.covariance.tolist(),
        hypotheses=[
            {"T_camera_object": mode.T_camera_object.tolist(), "weight": mode.weight}
            for mode in estimate.hypotheses
        ],
        ambiguities=[asdict(ambiguity) for ambiguity in estimate.ambiguities],
        certificates=asdict(estimate.certificates),
        assessment=result.assessment.stored(),
        converged=estimate.converged,
        seed=order.seed,
        config=order.config.to_dict(),
        start_spread=stored_spread(order.start_spread),
        known_objects=stored_known(order.known),
        symmetries_version=result.symmetries_version,
        used_frames=list(order.frames.used),
        other_frames=stored_others(order, estimate),
        version=__version__,
        algorithm=estimate.algorithm,
        hardware=estimate.hardware,
        seconds=estimate.seconds,
        evaluations=estimate.evaluations,
    )
