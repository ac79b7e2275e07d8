"""What runs inside a worker process.

A worker needs no shared files: a job brings the depth it looks at, and an object comes once and is kept. One
on the application's own machine is told of a folder, too, for what it builds of an object and may need again.
"""

import platform
import signal
import time
from collections import OrderedDict, deque
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from distributed import get_worker
from numpy.typing import NDArray

from registration_core import Estimate, Intrinsics, ObjectModel, SnapConfig, snap_steps
from registration_core.compilation import warm_up
from registration_core.viewpoint_model import viewpoint_model

KEPT_MODELS = 64
SECONDS_BETWEEN_REPORTS = 0.05

_models: OrderedDict[str, ObjectModel] = OrderedDict()
_cancelled: deque[str] = deque(maxlen=1000)


class SnapCancelledError(Exception):
    """The job was cancelled while it ran."""


@dataclass(frozen=True)
class SnapJob:
    """All that a worker needs for one snap, but for the object."""

    snap_id: str
    topic: str
    """Where progress is told; empty where nobody asks."""
    model_hash: str
    depth: NDArray[np.float32]
    """(H, W), metres: the part of the image that the snap may look at."""
    camera: Intrinsics
    """Of that part."""
    T_camera_object: NDArray[np.float64]
    config: SnapConfig
    seed: int
    start_spread: tuple[float, float] | None
    """How far off T_camera_object may be, metres and radians; None where that is unknown."""


@dataclass(frozen=True)
class JobResult:
    """An estimate, and what it was made with."""

    estimate: Estimate
    hardware: str


def run_snap(job: SnapJob, model: ObjectModel | None, cache_dir: Path | None = None) -> JobResult | None:
    """Run one snap, telling how far it is and stopping when it is cancelled.

    Args:
        model: The object, where it has to be sent.
        cache_dir: Where a worker, which may be the one before this, keeps what it built of objects.

    Returns:
        None where the object was not sent and is not known here: the job has to come again with it.

    Raises:
        SnapCancelledError: where `cancel` was called meanwhile.
        ValueError: where the job is bad, as `registration_core.snap` says.
    """
    known = model or _models.get(job.model_hash)
    if known is None:
        return None
    _report(job, 0.0)
    reported = time.monotonic()
    prepare(known, cache_dir)
    estimate = None
    rng = np.random.default_rng(job.seed)
    steps = snap_steps(known, job.depth, job.camera, job.T_camera_object, job.config, rng, job.start_spread)
    for step in steps:
        if job.snap_id in _cancelled:
            raise SnapCancelledError(job.snap_id)
        if time.monotonic() - reported > SECONDS_BETWEEN_REPORTS:
            reported = time.monotonic()
            _report(job, step.iteration / max(1, step.iterations))
        estimate = step.estimate
    assert estimate is not None
    return JobResult(estimate, _hardware())


def prepare(model: ObjectModel, cache_dir: Path | None) -> None:
    """Build what a snap needs of an object before the first snap asks for it."""
    _keep(model)
    viewpoint_model(model, cache_dir)


def cancel(snap_id: str) -> None:
    """Stop a snap at its next step, if it runs here or comes here later."""
    _cancelled.append(snap_id)


def dask_setup(dask_worker: Any) -> None:
    """Dask preload: load every compiled kernel before the first job comes."""
    if dask_worker.nanny:  # which ends this process in order when someone presses Ctrl-C
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    warm_up()


def _report(job: SnapJob, share: float) -> None:
    if job.topic:
        get_worker().log_event(job.topic, {"snap_id": job.snap_id, "progress": share})


def _keep(model: ObjectModel) -> None:
    _models[model.content_hash] = model
    _models.move_to_end(model.content_hash)
    while len(_models) > KEPT_MODELS:
        _models.popitem(last=False)


def _hardware() -> str:
    return f"{platform.machine()} {platform.processor() or 'cpu'} on {platform.node()}"
