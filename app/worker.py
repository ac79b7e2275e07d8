"""What runs inside a worker process.

A worker needs no shared files: a job brings the depth it looks at, and an object comes once and is kept. One
on the application's own machine is told of a folder, too, for what it builds of an object and may need again.
"""

import platform
import signal
import time
from abc import ABC, abstractmethod
from collections import OrderedDict, deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
from distributed import get_worker
from numpy.typing import NDArray

from registration_core import (
    ALGORITHM,
    Estimate,
    Hypothesis,
    Intrinsics,
    ObjectModel,
    SnapConfig,
    propose,
    snap_steps,
)
from registration_core.compilation import warm_up
from registration_core.viewpoint_model import viewpoint_model

KEPT_MODELS = 64
SECONDS_BETWEEN_REPORTS = 0.05

_models: OrderedDict[str, ObjectModel] = OrderedDict()
_cancelled: deque[str] = deque(maxlen=1000)

Result = TypeVar("Result")
Tell = Callable[[float], None]
"""Told the share that is done; raises where the job was cancelled."""


class SnapCancelledError(Exception):
    """The job was cancelled while it ran."""


@dataclass(frozen=True)
class Job(ABC, Generic[Result]):
    """All that a worker needs for one task, but for the object."""

    snap_id: str
    """Names the job."""
    topic: str
    """Where progress is told; empty where nobody asks."""
    model_hash: str
    depth: NDArray[np.float32]
    """(H, W), metres: the part of the image that may be looked at."""
    camera: Intrinsics
    """Of that part."""
    config: SnapConfig

    @abstractmethod
    def run(self, model: ObjectModel, tell: Tell) -> Result:
        """Do it; raises ValueError where the job is bad."""


@dataclass(frozen=True)
class JobResult:
    """An estimate, and what it was made with."""

    estimate: Estimate
    hardware: str


@dataclass(frozen=True)
class SnapJob(Job[JobResult]):
    """A snap."""

    seed: int
    T_camera_object: NDArray[np.float64]
    start_spread: tuple[float, float] | None
    """How far off T_camera_object may be, metres and radians; None where that is unknown."""
    explained: NDArray[np.bool_] | None = None
    """(H, W), the pixels of other objects whose pose is known; None where there are none."""

    def run(self, model: ObjectModel, tell: Tell) -> JobResult:
        """See `registration_core.snap`."""
        estimate = None
        rng = np.random.default_rng(self.seed)
        for step in snap_steps(
            model,
            self.depth,
            self.camera,
            self.T_camera_object,
            self.config,
            rng,
            self.start_spread,
            self.explained,
        ):
            tell(step.iteration / max(1, step.iterations))
            estimate = step.estimate
        assert estimate is not None
        return JobResult(estimate, hardware())


@dataclass(frozen=True)
class Proposals:
    """Likely poses, best first, and what they were made with."""

    hypotheses: tuple[Hypothesis, ...]
    seconds: float
    algorithm: str
    """`registration_core.ALGORITHM` of the worker."""
    hardware: str


@dataclass(frozen=True)
class SearchJob(Job[Proposals]):
    """A search for the object, without a start."""

    seed: int
    region: tuple[int, int, int, int] | None
    """(left, top, width, height) in pixels, where to look; everywhere where it is None."""

    def run(self, model: ObjectModel, tell: Tell) -> Proposals:
        """See `registration_core.propose`, which cannot be stopped half-way but is soon done."""
        tell(0.0)
        started = time.perf_counter()
        rng = np.random.default_rng(self.seed)
        found = propose(model, self.depth, self.camera, self.region, self.config, rng)
        return Proposals(found, time.perf_counter() - started, ALGORITHM, hardware())


def run_job(job: Job[Result], model: ObjectModel | None, cache_dir: Path | None = None) -> Result | None:
    """Run one job, telling how far it is and stopping when it is cancelled.

    Args:
        model: The object, where it has to be sent.
        cache_dir: Where a worker, which may be the one before this, keeps what it built of objects.

    Returns:
        None where the object was not sent and is not known here: the job has to come again with it.

    Raises:
        SnapCancelledError: where `cancel` was called meanwhile.
        ValueError: where the job is bad.
    """
    known = model or _models.get(job.model_hash)
    if known is None:
        return None
    tell = _teller(job.snap_id, job.topic)
    tell(0.0)
    prepare(known, cache_dir)
    return job.run(known, tell)


def prepare(model: ObjectModel, cache_dir: Path | None) -> None:
    """Build what a snap needs of an object before the first snap asks for it."""
    _keep(model)
    viewpoint_model(model, cache_dir)


def cancel(snap_id: str) -> None:
    """Stop a job at its next step, if it runs here or comes here later."""
    _cancelled.append(snap_id)


def dask_setup(dask_worker: Any) -> None:
    """Dask preload: load every compiled kernel before the first job comes."""
    if dask_worker.nanny:  # which ends this process in order when someone presses Ctrl-C
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    warm_up()


def _teller(snap_id: str, topic: str) -> Tell:
    reported = float("-inf")

    def tell(share: float) -> None:
        nonlocal reported
        if snap_id in _cancelled:
            raise SnapCancelledError(snap_id)
        if topic and time.monotonic() - reported > SECONDS_BETWEEN_REPORTS:
            reported = time.monotonic()
            get_worker().log_event(topic, {"snap_id": snap_id, "progress": share})

    return tell


def _keep(model: ObjectModel) -> None:
    _models[model.content_hash] = model
    _models.move_to_end(model.content_hash)
    while len(_models) > KEPT_MODELS:
        _models.popitem(last=False)


def hardware() -> str:
    """Names the machine that this process computes on."""
    return f"{platform.machine()} {platform.processor() or 'cpu'} on {platform.node()}"
