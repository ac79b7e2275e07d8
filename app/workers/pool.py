"""Hands snaps and searches to worker processes on Dask, tells how far they are, and cancels them."""

import copy
import logging
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from concurrent.futures import Future as PlannedCall
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, TypeVar

import dask
from distributed import Client, Future, KilledWorker, LocalCluster
from distributed.security import Security

from app.config import Settings
from app.storage.clock import BOOT_ID
from app.storage.files import PreparedStore
from app.workers import jobs
from app.workers.prepared import PreparedObjects
from registration_core import ObjectModel
from registration_core.algorithm import VIEWPOINT_ALGORITHM

logger = logging.getLogger(__name__)


DIED = "The worker died while it computed this. Nothing is lost; try again."
UNREACHABLE = "The workers cannot be reached. Nothing is lost; try again."
BACKGROUND = -1
"""Priority of what nobody waits for, yet."""
PATIENCE = 5.0
"""Seconds in which all workers answer, but for stuck ones; ..."""
PATIENCE_TO_SEND = 30.0
"""... and where an object is sent to them."""

CLUSTER_SETTINGS: dict[str, object] = {
    # A snap that killed its worker once is not tried on the others.
    "scheduler.allowed-failures": 0,
    # Workers that were silent while this machine slept are not taken for dead when it wakes up.
    "scheduler.worker-ttl": None,
    "scheduler.http.routes": [],
    "worker.http.routes": [],
    # What follows watches Dask itself, many times a second in each process, whether or not anybody snaps.
    "admin.tick.interval": "1s",
    "admin.system-monitor.interval": "10s",
    "worker.profile.enabled": False,
    "scheduler.active-memory-manager.start": False,
}
"""Of Dask, under `distributed`, for workers that are started here."""

Result = TypeVar("Result")


class SnapError(Exception):
    """A snap that came to nothing; the message may be shown."""


@dataclass
class _Pending:
    """A job that may still bring a result."""

    job: jobs.Job[Any]
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
    preparing: bool = False
    """Its object is being built, or fetched."""


@dataclass(frozen=True)
class Standing:
    """How a snap stands that has brought no result yet."""

    workers: int
    """How many are there now."""
    ahead: int
    """How many snaps go before it; 0 once it runs."""
    seconds: float
    """How long it has waited or, once a worker is at it, has run."""
    preparing: bool
    """Whether it waits for its object, which is built once."""


class Snapper:
    """Worker processes and the snaps they are at.

    Args:
        scheduler_address: A Dask scheduler; empty starts worker processes on this machine.
        workers: How many to start on this machine.
        store: Where what they built of objects is kept.
    """

    def __init__(self, scheduler_address: str, workers: int, store: PreparedStore) -> None:
        self._scheduler_address = scheduler_address
        self._workers = workers
        self._objects = PreparedObjects(store, self._submit_build, self._later)
        self.topic = f"snap6d-{BOOT_ID}"
        """Where workers tell how far they are."""
        self._pending: dict[str, _Pending] = {}
        self._left: dict[str, _Pending] = {}
        """Jobs nobody waits for any more, whose workers have not been told yet."""
        self._lock = threading.Lock()
        self._cluster: LocalCluster | None = None
        # Whatever talks to the scheduler happens here, so that no operator waits for it.
        self._calls = ThreadPoolExecutor(max_workers=4, thread_name_prefix="snapping")
        # What jobs bring is taken in here, one result after the other, as they come.
        self._results = ThreadPoolExecutor(max_workers=1, thread_name_prefix="results")
        self._client: PlannedCall[Client] = self._calls.submit(self._connect)

    def wait_until_ready(self) -> None:
        """Return when workers are there; raises what kept them from starting."""
        self.client()

    def client(self) -> Client:
        """Dask's client, when workers are there; raises what kept them from starting."""
        return self._client.result()

    def worker_count(self) -> int:
        """How many workers are there now."""
        if not self._client.done() or self._client.exception() is not None:
            return 0
        return len(self.client().scheduler_info(n_workers=-1)["workers"])

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
        return Standing(workers, ahead, time.monotonic() - mine.since, mine.preparing)

    def request(
        self,
        job: jobs.Job[Result],
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
        self._call(job.snap_id, self._submit, job.snap_id, None)
        return lambda: self._cancel(job.snap_id)

    def built(self, model: ObjectModel, priority: int = BACKGROUND) -> PlannedCall[bytes]:
        """What a worker builds of an object, once: see `PreparedObjects.get`."""
        return self._objects.get(model, priority)

    def prepare(self, model: ObjectModel) -> None:
        """Let every worker know an object, soon and in the background."""
        self._calls.submit(self._prepare, model)

    def hand_over(self, model_hashes: Sequence[str]) -> None:
        """Let every worker know objects that were built before; waits until they do."""
        for model_hash in self._lacking(model_hashes):
            content = self._objects.read(model_hash)
            if content is not None:
                self._send(model_hash, content)

    def close(self) -> None:
        """Let workers elsewhere go from whatever they are at, and stop those that were started here."""
        self._leave_all()
        self._objects.close()
        for pool in (self._results, self._calls):
            pool.shutdown(wait=True, cancel_futures=True)
        self._leave_all()  # what was asked for in between
        if self._client.done() and not self._client.cancelled() and self._client.exception() is None:
            with suppress(OSError):  # the scheduler may be gone already
                self._stop(list(self._left))
            self.client().close()
        if self._cluster is not None:
            self._cluster.close()

    def _leave_all(self) -> None:
        with self._lock:
            self._left |= self._pending
            self._pending.clear()

    def _connect(self) -> Client:
        if not self._scheduler_address:
            self._cluster = start_workers(self._workers)
        client = Client(self._cluster or self._scheduler_address, set_as_default=False)
        client.subscribe_topic(self.topic, self._on_report)
        return client

    def _call(self, snap_id: str, function: Callable[..., None], *args: Any) -> None:
        def report(call: PlannedCall[None]) -> None:
            error = None if call.cancelled() else call.exception()
            if error is not None:
                self._end(snap_id, _failure(error))

        self._calls.submit(function, *args).add_done_callback(report)

    def _later(self, function: Callable[..., None], *args: Any) -> None:
        """Do something that may wait for the scheduler, unless all is closed.

        Dask calls back in one thread for all clients of a process: who waits there for what a closed client
        was to bring, waits for ever, and all others with him. Calls of our own end before ours is closed.
        """
        with suppress(RuntimeError):  # of a pool that takes no more
            self._results.submit(function, *args)

    def _submit(self, snap_id: str, content: bytes | None) -> None:
        pending = self._find(snap_id)
        if pending is None:
            return
        pending.preparing = False
        future = self.client().submit(
            jobs.run_job, pending.job, content, pure=False, priority=pending.priority
        )
        pending.future = future
        if self._find(snap_id) is None:  # cancelled in this moment
            with self._lock:
                self._left[snap_id] = pending
            self._stop([snap_id])
            return
        future.add_done_callback(lambda done: self._later(self._on_done, snap_id, done))

    def _submit_with_object(self, snap_id: str) -> None:
        """Submit a job again, whose worker does not know the object."""
        pending = self._find(snap_id)
        if pending is None:
            return
        pending.preparing = True

        def submit(built: PlannedCall[bytes]) -> None:
            if self._find(snap_id) is not None:
                self._call(snap_id, lambda: self._submit(snap_id, built.result()))

        self.built(pending.model, pending.priority).add_done_callback(submit)

    def _on_done(self, snap_id: str, future: Future) -> None:
        if self._find(snap_id) is None:
            return
        try:
            result = future.result()
            if result is None:
                self._call(snap_id, self._submit_with_object, snap_id)
            else:
                self._end(snap_id, result)
        except KilledWorker:
            self._on_killed(snap_id)
        except Exception as error:
            self._end(snap_id, _failure(error))

    def _on_killed(self, snap_id: str) -> None:
        pending = self._find(snap_id)
        if pending is None:
            return
        if pending.begun:
            self._end(snap_id, SnapError(DIED))
            return
        pending.begun = True  # it was handed to a worker that was dead already: that is not its fault
        self._call(snap_id, self._submit, snap_id, None)

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
                self._left[snap_id] = pending
        if pending is not None:
            with suppress(RuntimeError):  # of a pool that takes no more: closing tells all that are left
                self._calls.submit(self._stop, [snap_id])

    def _stop(self, snap_ids: Sequence[str]) -> None:
        """Tell the workers of jobs that were left."""
        with self._lock:
            left = {one: self._left.pop(one) for one in snap_ids if one in self._left}
        submitted = {
            snap_id: pending.future for snap_id, pending in left.items() if pending.future is not None
        }
        if submitted:
            self._ask(jobs.cancel, list(submitted))
        for future in submitted.values():
            future.cancel()

    def _submit_build(self, model: ObjectModel, priority: int) -> Future:
        return self.client().submit(jobs.build, model, pure=False, priority=priority)

    def _prepare(self, model: ObjectModel) -> None:
        if not self._lacking([model.content_hash]):
            return

        def send(built: PlannedCall[bytes]) -> None:
            error = built.exception()
            if error is None:
                self._calls.submit(self._send, model.content_hash, built.result())
            elif not isinstance(error, CancelledError):
                logger.warning("an object could not be prepared: %s", error)

        self.built(model, 0).add_done_callback(send)

    def _send(self, model_hash: str, content: bytes) -> None:
        """Let the workers that do not know an object know it, whatever they are at."""
        addresses = self._lacking([model_hash]).get(model_hash)
        if addresses:
            self._ask(jobs.keep, model_hash, content, workers=addresses, patience=PATIENCE_TO_SEND)

    def _lacking(self, model_hashes: Sequence[str]) -> dict[str, list[str]]:
        """The workers that do not know objects, by object."""
        told = self._ask(jobs.lacking, list(model_hashes))
        by_object = {one: [address for address in told if one in told[address]] for one in model_hashes}
        return {model_hash: addresses for model_hash, addresses in by_object.items() if addresses}

    def _ask(
        self,
        function: Callable[..., Any],
        *args: Any,
        workers: list[str] | None = None,
        patience: float | None = None,
    ) -> dict[str, Any]:
        """What workers, or all, answer at once, by address. Where one is stuck none counts: nothing that is
        asked for here must be, since workers ask for what they lack and a result nobody waits for is dropped.
        """
        within = PATIENCE if patience is None else patience
        try:
            answers: dict[str, Any] = self.client().run(
                function, *args, workers=workers, on_error="ignore", callback_timeout=within
            )
        except TimeoutError:
            logger.warning("not all workers answered within %g s; one may be stuck", within)
            return {}
        return answers


def start_workers(count: int) -> LocalCluster:
    """Worker processes on this machine, and a scheduler of theirs, set as `CLUSTER_SETTINGS` say.

    They talk by TLS with certificates that are made here and kept in memory, and show no pages: other
    accounts of this machine reach their ports as well, and could let them run anything.
    """
    # For good, and not for as long as this starts: workers that die are started anew by what is set then.
    # A copy, for Dask adds pages to the very list that is set, whichever cluster they are of.
    settings = copy.deepcopy(CLUSTER_SETTINGS)
    dask.config.set({f"distributed.{key}": value for key, value in settings.items()})
    return LocalCluster(
        n_workers=count,
        threads_per_worker=1,
        host="127.0.0.1",
        security=Security.temporary(),
        scheduler_kwargs={"dashboard": False},
        dashboard_address="127.0.0.1:0",
        worker_dashboard_address="127.0.0.1:0",
        memory_limit=0,
        preload=["app.workers.jobs"],
        silence_logs=logging.CRITICAL,
    )


def create_snapper(settings: Settings) -> Snapper:
    """Start, or reach for, the workers that the settings ask for."""
    store = PreparedStore(settings.prepared_dir.resolve(), VIEWPOINT_ALGORITHM)
    return Snapper(settings.scheduler_address, settings.workers, store)


def _goes_before(one: _Pending, other: _Pending) -> bool:
    """Whether one waits for a worker as the other does, and is to get one earlier."""
    return not one.running and (-one.priority, one.since) < (-other.priority, other.since)


def _failure(error: BaseException) -> SnapError:
    """What is told of a job that came to nothing."""
    if isinstance(error, ValueError):
        return SnapError(f"The snap cannot work on this: {error}.")
    if isinstance(error, KilledWorker):
        return SnapError(DIED)
    if isinstance(error, CancelledError | OSError):
        return SnapError(UNREACHABLE)
    logger.error("a snap failed", exc_info=error)
    return SnapError("The snap failed; the server's log says why. Nothing is lost; try again.")
