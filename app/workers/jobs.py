"""What runs inside a worker process.

A worker needs no shared files: a job brings the depth it looks at, and what was built of an object comes once
and is kept.
"""

import signal
import threading
import time
from abc import ABC, abstractmethod
from collections import OrderedDict, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
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
    snap_views_steps,
)
from registration_core.compilation import warm_up
from registration_core.hardware import hardware
from registration_core.search.viewpoint_model import ViewpointModel, build_viewpoint_model, packed, unpacked

KEPT_OBJECTS = 64
"""Of about 4.5 MB."""
SECONDS_BETWEEN_REPORTS = 0.05

_objects: OrderedDict[str, ViewpointModel] = OrderedDict()
_lock = threading.Lock()
"""Objects are handed over while jobs run."""
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
    config: SnapConfig

    @abstractmethod
    def run(self, known: ViewpointModel, tell: Tell) -> Result:
        """Do it; raises ValueError where the job is bad."""


@dataclass(frozen=True)
class ImageJob(Job[Result]):
    """A task that one image is enough for."""

    depth: NDArray[np.float32]
    """(H, W), metres."""
    camera: Intrinsics


@dataclass(frozen=True)
class JobView:
    """What a job may look at of one frame."""

    depth: NDArray[np.float32]
    """(H, W), metres: the part of the image that may be looked at."""
    camera: Intrinsics
    """Of that part."""
    T_shown_camera: NDArray[np.float64]
    """(4, 4), where it stands, in the camera axes of the frame that is shown."""
    explained: NDArray[np.bool_] | None
    """(H, W), the pixels of other objects whose pose is known; None where there are none."""
    color: NDArray[np.uint8] | None
    """(H, W, 3), aligned with the depth; None where there is none."""


@dataclass(frozen=True)
class SnapJob(Job[Estimate]):
    """A snap; its poses are in the camera axes of the frame that is shown, used or not."""

    seed: int
    views: tuple[JobView, ...]
    used: int
    """The first so many views; the others are asked whether they agree."""
    T_camera_object: NDArray[np.float64]
    start_spread: tuple[float, float] | None
    """How far off T_camera_object may be, metres and radians; None where that is unknown."""

    def run(self, known: ViewpointModel, tell: Tell) -> Estimate:
        """See `registration_core.snap_views`."""
        estimate = None
        rng = np.random.default_rng(self.seed)
        for step in snap_views_steps(
            known,
            [(view.depth, view.camera, view.T_shown_camera) for view in self.views],
            self.T_camera_object,
            self.config,
            rng,
            self.start_spread,
            [view.explained for view in self.views],
            self.used,
            [view.color for view in self.views],
        ):
            tell(step.iteration / max(1, step.iterations))
            estimate = step.estimate
        assert estimate is not None
        return estimate


@dataclass(frozen=True)
class Proposals:
    """Likely poses, best first, and what they were made with."""

    hypotheses: tuple[Hypothesis, ...]
    seconds: float
    """Wall-clock time it took."""
    algorithm: str
    """`registration_core.ALGORITHM` of the worker."""
    hardware: str


@dataclass(frozen=True)
class SearchJob(ImageJob[Proposals]):
    """A search for the object, without a start."""

    seed: int
    region: tuple[int, int, int, int] | None
    """(left, top, width, height) in pixels, where to look; everywhere where it is None."""

    def run(self, known: ViewpointModel, tell: Tell) -> Proposals:
        """See `registration_core.propose`, which cannot be stopped half-way but is soon done."""
        tell(0.0)
        started = time.perf_counter()
        rng = np.random.default_rng(self.seed)
        found = propose(known, self.depth, self.camera, self.region, self.config, rng)
        return Proposals(found, time.perf_counter() - started, ALGORITHM, hardware())


def run_job(job: Job[Result], content: bytes | None) -> Result | None:
    """Run one job, telling how far it is and stopping when it is cancelled.

    Args:
        content: What was built of the object, where it has to be sent.

    Returns:
        None where the object was not sent and is not known here: the job has to come again with it.

    Raises:
        SnapCancelledError: where `cancel` was called meanwhile.
        ValueError: where the job is bad.
    """
    if content is not None:
        keep(job.model_hash, content)
    known = _known(job.model_hash)
    if known is None:
        return None
    tell = _teller(job.snap_id, job.topic)
    tell(0.0)
    return job.run(known, tell)


def build(model: ObjectModel) -> bytes:
    """Build what a snap needs of an object; raises ValueError where it cannot be looked for."""
    built = build_viewpoint_model(model)
    _keep(model.content_hash, built)
    return packed(built)


def keep(model_hash: str, content: bytes) -> None:
    """Know an object from now on by what was built of it, maybe elsewhere."""
    _keep(model_hash, unpacked(content))


def lacking(model_hashes: Sequence[str]) -> set[str]:
    """Those of the objects that are not known here."""
    return {model_hash for model_hash in model_hashes if model_hash not in _objects}


def cancel(snap_ids: Sequence[str]) -> None:
    """Stop jobs at their next step, if they run here or come here later."""
    _cancelled.extend(snap_ids)


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


def _known(model_hash: str) -> ViewpointModel | None:
    with _lock:
        if model_hash in _objects:
            _objects.move_to_end(model_hash)
        return _objects.get(model_hash)


def _keep(model_hash: str, built: ViewpointModel) -> None:
    with _lock:
        _objects[model_hash] = built
        _objects.move_to_end(model_hash)
        while len(_objects) > KEPT_OBJECTS:
            _objects.popitem(last=False)
