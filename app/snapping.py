"""Hands snaps and searches to worker processes on Dask, tells how far they are, and cancels them."""

import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import CancelledError, ThreadPoolExecutor
from concurrent.futures import Future as PlannedCall
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import dask
from distributed import Client, Future, KilledWorker, LocalCluster, fire_and_forget

from app import worker
from app.clock import BOOT_ID
from app.config import Settings
from registration_core import ObjectModel

logger = logging.getLogger(__name__)


DIED = "The worker died while it computed this. Nothing is lost; try again."
UNREACHABLE = "The workers cannot be reached. Nothing is lost; try again."

Result = TypeVar("Result")


class SnapError(Exception):
    """A snap that came to nothing; the message may be shown."""


@dataclass
class _Pending:
    """A job that may still bring a result."""

    job: worker.Job[Any]
    model: ObjectModel
    on_progress: Callable[[float], None]
    on_end: Callable[[Any], None]
    priority: int
    since: float = field(default_factory=time.monotonic)
    """When it was asked for or, once a worker is at it, when that began."""
    running: bool = False
    """A worker is at it."""
    future: Future | None = None
    begun: bool = False
    """A worker has told that it is at it, or was given the job for the second time."""


@dataclass(frozen=True)
class Standing:
    """How a snap stands that has brought no result yet."""

    workers: int
    """How many are there now."""
    ahead: int
    """How many snaps go before it; 0 once it runs."""
    seconds: float
    """How long it has waited or, once a worker is at it, has run."""


class Snapper:
    """Worker processes and the snaps they are at.

    Args:
        scheduler_address: A Dask scheduler; empty starts worker processes on this machine.
        workers: How many to start on this machine.
        cache_dir: Where workers of this machine keep what they built of an object.
    """

    def __init__(self, scheduler_address: str, workers: int, cache_dir: Path) -> None:
        self._scheduler_address = scheduler_address
        self._workers = workers
        self._cache_dir = None if scheduler_address else cache_dir
        self.topic = f"snap6d-{BOOT_ID}"
        """Where workers tell how far they are."""
        self._pending: dict[str, _Pending] = {}
        self._lock = threading.Lock()
        self._cluster: LocalCluster | None = None
        # Whatever talks to the scheduler happens here, so that no operator waits for it.
        self._calls = ThreadPoolExecutor(max_workers=4, thread_name_prefix="snapping")
        self._client: PlannedCall[Client] = self._calls.submit(self._connect)

    def wait_until_ready(self) -> None:
        """Return when workers are there; raises what kept them from starting."""
        self._client.result()

    def worker_count(self) -> int:
        """How many workers are there now."""
        if not self._client.done() or self._client.exception() is not None:
            return 0
        return len(self._client.result().scheduler_info(n_workers=-1)["workers"])

    def waiting_count(self) -> int:
        """How many snaps wait for a worker now; live ones, which nobody waits for, do not count."""
        with self._lock:
            return sum(pending.priority >= 0 and not pending.running for pending in self._pending.values())

    def standing(self, snap_id: str) -> Standing | None:
        """How a snap stands; None where it has ended."""
        workers = self.worker_count()
        with self._lock:
            mine = self._pending.get(snap_id)
            if mine is None:
                return None
            ahead = 0 if mine.running else sum(_goes_before(one, mine) for one in self._pending.values())
        return Standing(workers, ahead, time.monotonic() - mine.since)

    def request(
        self,
        job: worker.Job[Result],
        model: ObjectModel,
        on_progress: Callable[[float], None],
        on_end: Callable[[Result | SnapError], None],
        priority: int = 0,
    ) -> Callable[[], None]:
        """Start a job and return the function that cancels it.

        `on_end` is called once, from another thread, unless the job is cancelled before. Of jobs that wait
        for a worker, those of higher `priority` go first.
        """
        with self._lock:
            self._pending[job.snap_id] = _Pending(job, model, on_progress, on_end, priority)
        self._call(job.snap_id, self._submit, job.snap_id, False)
        return lambda: self._cancel(job.snap_id)

    def prepare(self, model: ObjectModel) -> None:
        """Let every worker build what it needs of an object, soon and in the background."""
        self._calls.submit(self._prepare, model)

    def close(self) -> None:
        """Stop the workers that were started here."""
        with self._lock:
            self._pending.clear()
        self._calls.shutdown(wait=True, cancel_futures=True)
        if self._client.done() and not self._client.cancelled() and self._client.exception() is None:
            self._client.result().close()
        if self._cluster is not None:
            self._cluster.close()

    def _connect(self) -> Client:
        # A snap that killed its worker once is not tried on the others.
        dask.config.set({"distributed.scheduler.allowed-failures": 0})
        if not self._scheduler_address:
            self._cluster = LocalCluster(
                n_workers=self._workers,
                threads_per_worker=1,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",
                worker_dashboard_address="127.0.0.1:0",
                memory_limit=0,
                preload=["app.worker"],
                silence_logs=logging.CRITICAL,
            )
        client = Client(self._cluster or self._scheduler_address, set_as_default=False)
        client.subscribe_topic(self.topic, self._on_report)
        return client

    def _call(self, snap_id: str, function: Callable[..., None], *args: Any) -> None:
        def report(call: PlannedCall[None]) -> None:
            error = None if call.cancelled() else call.exception()
            if error is not None:
                logger.error("a snap could not be handed to the workers", exc_info=error)
                self._end(snap_id, SnapError(UNREACHABLE))

        self._calls.submit(function, *args).add_done_callback(report)

    def _submit(self, snap_id: str, with_model: bool) -> None:
        pending = self._find(snap_id)
        if pending is None:
            return
        model = pending.model if with_model else None
        future = self._client.result().submit(
            worker.run_job, pending.job, model, self._cache_dir, pure=False, priority=pending.priority
        )
        pending.future = future
        if self._find(snap_id) is None:  # cancelled in this moment
            self._stop(pending)
            return
        future.add_done_callback(lambda done: self._on_done(snap_id, done))

    def _on_done(self, snap_id: str, future: Future) -> None:
        if self._find(snap_id) is None:
            return
        try:
            result = future.result()
            if result is None:
                self._call(snap_id, self._submit, snap_id, True)
            else:
                self._end(snap_id, result)
        except ValueError as error:
            self._end(snap_id, SnapError(f"The snap cannot work on this: {error}."))
        except KilledWorker:
            self._on_killed(snap_id)
        except (CancelledError, OSError):
            self._end(snap_id, SnapError(UNREACHABLE))
        except Exception:
            logger.exception("a snap failed")
            self._end(
                snap_id, SnapError("The snap failed; the server's log says why. Nothing is lost; try again.")
            )

    def _on_killed(self, snap_id: str) -> None:
        pending = self._find(snap_id)
        if pending is None:
            return
        if pending.begun:
            self._end(snap_id, SnapError(DIED))
            return
        pending.begun = True  # it was handed to a worker that was dead already: that is not its fault
        self._call(snap_id, self._submit, snap_id, False)

    def _on_report(self, event: tuple[float, dict[str, Any]]) -> None:
        _, report = event
        pending = self._find(report["snap_id"])
        if pending is not None:
            pending.begun = True
            if not pending.running:
                pending.running, pending.since = True, time.monotonic()
            pending.on_progress(report["progress"])

    def _find(self, snap_id: str) -> _Pending | None:
        with self._lock:
            return self._pending.get(snap_id)

    def _end(self, snap_id: str, outcome: object) -> None:
        with self._lock:
            pending = self._pending.pop(snap_id, None)
        if pending is not None:
            pending.on_end(outcome)

    def _cancel(self, snap_id: str) -> None:
        with self._lock:
            pending = self._pending.pop(snap_id, None)
        if pending is not None:
            self._calls.submit(self._stop, pending)

    def _stop(self, pending: _Pending) -> None:
        client = self._client.result()
        if pending.future is None:
            return
        client.run(worker.cancel, pending.job.snap_id)
        pending.future.cancel()

    def _prepare(self, model: ObjectModel) -> None:
        client = self._client.result()
        for address in client.scheduler_info(n_workers=-1)["workers"]:
            future = client.submit(
                worker.prepare, model, self._cache_dir, workers=[address], pure=False, priority=-1
            )
            future.add_done_callback(_log_failure)
            fire_and_forget(future)


def create_snapper(settings: Settings) -> Snapper:
    """Start, or reach for, the workers that the settings ask for."""
    return Snapper(settings.scheduler_address, settings.workers, settings.cache_dir.resolve())


def _goes_before(one: _Pending, other: _Pending) -> bool:
    """Whether one waits for a worker as the other does, and is to get one earlier."""
    return not one.running and (-one.priority, one.since) < (-other.priority, other.since)


def _log_failure(future: Future) -> None:
    if future.status == "error":
        logger.warning("an object could not be prepared: %s", future.exception())
