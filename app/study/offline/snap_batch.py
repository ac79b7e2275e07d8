"""Several snaps of one object in one image as one job: handing each over alone costs workers their time."""

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.workers.jobs import ImageJob, Tell
from registration_core import ALGORITHM, snap_steps
from registration_core.hardware import hardware
from registration_core.search.viewpoint_model import ViewpointModel

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BatchStart:
    """Where one of the snaps starts."""

    T_camera_object: Array
    """(4, 4)."""
    seed: int


@dataclass(frozen=True, eq=False)
class BatchOutcome:
    """What one of the snaps came to."""

    T_camera_object: Array | None
    """(4, 4); None where it failed."""
    confidence: float | None
    seconds: float
    evaluations: int
    message: str = ""
    """Why it failed."""


@dataclass(frozen=True)
class BatchResult:
    """An outcome for each start, and what they were computed on."""

    outcomes: tuple[BatchOutcome, ...]
    algorithm: str
    """`registration_core.ALGORITHM` of the worker."""
    hardware: str


@dataclass(frozen=True)
class SnapBatch(ImageJob[BatchResult]):
    """Snaps that know nothing of how far off their starts are, nor of other objects; `depth` is all of it."""

    starts: tuple[BatchStart, ...]
    color: NDArray[np.uint8] | None
    """(H, W, 3), aligned with the depth; None where there is none."""

    def run(self, known: ViewpointModel, tell: Tell) -> BatchResult:
        """One after the other; one that fails leaves the others as they are."""
        outcomes = tuple(self._outcome(known, number, tell) for number in range(len(self.starts)))
        return BatchResult(outcomes, ALGORITHM, hardware())

    def _outcome(self, known: ViewpointModel, number: int, tell: Tell) -> BatchOutcome:
        start = self.starts[number]
        began, rng = time.perf_counter(), np.random.default_rng(start.seed)
        estimate = None
        try:
            for step in snap_steps(
                known, self.depth, self.camera, start.T_camera_object, self.config, rng, color=self.color
            ):
                tell((number + step.iteration / step.iterations) / len(self.starts))
                estimate = step.estimate
        except ValueError as error:
            return BatchOutcome(None, None, time.perf_counter() - began, 0, f"{error}")
        assert estimate is not None
        return BatchOutcome(
            estimate.T_camera_object, estimate.confidence, estimate.seconds, estimate.evaluations
        )
