"""Offline snaps: what a snap gives from every pose that operators passed through, computed afterwards.

The batch may be stopped at any time, by SIGKILL too, and started again: what is stored is not computed again,
and the rest comes out the same, for a snap's seed depends on its input alone.
"""

import uuid
from collections import defaultdict
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from itertools import groupby, islice
from queue import SimpleQueue

import numpy as np

from app import __version__
from app.datasets.scene_data import SceneData, camera_of
from app.storage.database import Database
from app.storage.tables import Method
from app.study.offline.samples import Sample, samples_of
from app.study.offline.sampling import SAMPLINGS, Sampling
from app.study.offline.snap_batch import BatchResult, BatchStart, SnapBatch
from app.study.offline.snap_store import Outcome, SnapStore
from app.workers.methods import config_of
from app.workers.pool import SnapError, Snapper
from registration_core import ALGORITHM
from registration_core.geometry import pose

SNAPS_AT_ONCE: Mapping[Method, int] = {"default": 16, "paper": 1}
"""In one job of a worker, so that it takes a second, or a whole filter."""
SECONDS: Mapping[Method, float] = {"default": 0.05, "paper": 12.0}
"""That one core needs for a snap, roughly, until there are some that were measured."""
JOBS_A_WORKER = 2
"""That are under way or wait at a worker, so that it never has to."""
PRIORITY = -2
"""After whatever operators wait for or look at."""

Input = Sequence[Sample]
"""Samples that one snap stands for."""
Result = BatchResult | SnapError
Ended = tuple[str, Sequence[Input], Result]
"""A job's id, what it was for, and what it came to."""


class OfflineError(Exception):
    """The batch cannot go on; the message says why and may be shown."""


@dataclass(frozen=True)
class Plan:
    """What a batch is about to do."""

    sampled: int
    """Poses of the traces, in all."""
    chosen: int
    """Of these, the ones that are snapped."""
    snaps: int
    """Still to be computed, each for all samples of its input."""
    seconds: float
    """That they will take, roughly."""


@dataclass(frozen=True)
class Summary:
    """What a batch did."""

    samples: int
    """That were chosen, in all."""
    computed: int
    """Snaps, each for all samples of its input."""
    failed: int
    """Of all samples."""


class OfflineBatch:
    """Computes and stores the offline snaps of registrations.

    Args:
        database: With their logs.
        data: With their images and objects.
        snapper: Whose workers compute.
        method: Of the snaps.
        sampling: Which poses are snapped; where it is None, those that suit the method.
    """

    def __init__(
        self,
        database: Database,
        data: SceneData,
        snapper: Snapper,
        method: Method = "default",
        sampling: Sampling | None = None,
    ) -> None:
        self._database = database
        self._store = SnapStore(database)
        self._data = data
        self._snapper = snapper
        self._method = method
        self._config = config_of(method)
        self.sampling = sampling or SAMPLINGS[method]

    def run(
        self,
        registration_ids: Sequence[int],
        on_progress: Callable[[int, int], None],
        on_plan: Callable[[Plan], None] = lambda plan: None,
    ) -> Summary:
        """Compute and store what is missing.

        Args:
            registration_ids: Whose samples; they must not change meanwhile.
            on_progress: Told how many samples have their snap, and of how many.
            on_plan: Told once what there is to do, before it begins.

        Raises:
            OfflineError: where the workers cannot be reached, one of them died, or one computes otherwise.
            StoreError: where another batch does the same.
        """
        sampled, total, missing = self._missing(registration_ids)
        known = self._store.outcomes([samples[0].input_hash for samples in missing])
        unknown = [samples for samples in missing if samples[0].input_hash not in known]
        copies = [
            (one, known[one.input_hash]) for samples in missing for one in samples if one.input_hash in known
        ]
        if copies:
            self._store.add(copies)
        done = total - sum(map(len, unknown))
        on_plan(Plan(sampled, total, len(unknown), self._duration(registration_ids, len(unknown))))
        on_progress(done, total)
        with closing(self._computed(unknown)) as results:
            for inputs, result in results:
                self._store.add(self._snaps(inputs, result))
                done += sum(map(len, inputs))
                on_progress(done, total)
        return Summary(total, len(unknown), self._store.failures(registration_ids, self._method))

    def _duration(self, registration_ids: Sequence[int], snaps: int) -> float:
        """Seconds that so many snaps will take, by those that there are, or else by what is usual."""
        if not snaps:
            return 0.0
        self._snapper.wait_until_ready()
        measured = self._store.median_seconds(registration_ids, self._method)
        each = measured if np.isfinite(measured) else SECONDS[self._method]
        return snaps * each / max(1, self._snapper.worker_count())

    def _missing(self, registration_ids: Sequence[int]) -> tuple[int, int, list[Input]]:
        """How many samples there are and how many are chosen, and of these the ones without their snap, by
        input; those of a view together.
        """
        inputs: dict[str, list[Sample]] = defaultdict(list)
        sampled = total = 0
        for registration_id in registration_ids:
            stored = self._store.stored(registration_id)
            samples = list(samples_of(self._database, registration_id, self._config))
            chosen = self.sampling.of(samples)
            sampled, total = sampled + len(samples), total + len(chosen)
            for sample in chosen:
                if (sample.seconds, sample.input_hash) not in stored:
                    inputs[sample.input_hash].append(sample)
        return sampled, total, sorted(inputs.values(), key=_view_of)

    def _computed(self, inputs: Sequence[Input]) -> Generator[tuple[Sequence[Input], BatchResult]]:
        """Results as they come; whatever ends this takes what is under way back from the workers."""
        self._snapper.wait_until_ready()
        batches, ended = _batches(inputs, SNAPS_AT_ONCE[self._method]), SimpleQueue[Ended]()
        under_way: dict[str, Callable[[], None]] = {}

        def hand_over(most: int) -> None:
            for batch in islice(batches, most):
                job, model = self._job(batch), self._data.model(batch[0][0].view.object)
                on_end = partial(_put, ended, job.snap_id, batch)
                under_way[job.snap_id] = self._snapper.request(job, model, _ignore, on_end, PRIORITY)

        try:
            hand_over(JOBS_A_WORKER * max(1, self._snapper.worker_count()))
            while under_way:
                snap_id, batch, result = ended.get()
                del under_way[snap_id]
                if isinstance(result, SnapError):
                    raise OfflineError(f"{result} Start the batch again to go on.")
                if result.algorithm != ALGORITHM:
                    raise OfflineError(
                        f"A worker computes with algorithm {result.algorithm}, this program with {ALGORITHM}."
                        " Install the same version of Snap6D on both, and start the batch again."
                    )
                hand_over(1)
                yield batch, result
        finally:
            for cancel in under_way.values():
                cancel()

    def _job(self, inputs: Sequence[Input]) -> SnapBatch:
        samples = [samples[0] for samples in inputs]
        view = samples[0].view
        T_camera_world = pose.inverse(np.array(view.frame.T_world_camera))
        return SnapBatch(
            snap_id=uuid.uuid4().hex,
            topic="",
            model_hash=self._data.model(view.object).content_hash,
            depth=self._data.depth(view.frame),
            color=self._data.aligned_color(view.frame),
            camera=camera_of(view.frame),
            config=self._config,
            starts=tuple(BatchStart(T_camera_world @ one.T_world_object, one.seed) for one in samples),
        )

    def _snaps(self, inputs: Sequence[Input], result: BatchResult) -> Iterator[tuple[Sample, Outcome]]:
        T_world_camera = np.array(inputs[0][0].view.frame.T_world_camera)
        for samples, outcome in zip(inputs, result.outcomes, strict=True):
            found = outcome.T_camera_object
            columns = {
                "config": self._config.to_dict(),
                "method": self._method,
                "seed": samples[0].seed,
                "T_world_object": None if found is None else (T_world_camera @ found).tolist(),
                "confidence": outcome.confidence,
                "message": outcome.message,
                "snap_seconds": outcome.seconds,
                "evaluations": outcome.evaluations,
                "version": __version__,
                "algorithm": result.algorithm,
                "hardware": result.hardware,
            }
            for sample in samples:
                yield sample, columns


def _view_of(samples: Input) -> tuple[int, int]:
    return samples[0].view.key


def _batches(inputs: Sequence[Input], most: int) -> Iterator[list[Input]]:
    for _, of_view in groupby(inputs, key=_view_of):
        while batch := list(islice(of_view, most)):
            yield batch


def _put(ended: SimpleQueue[Ended], snap_id: str, batch: Sequence[Input], result: Result) -> None:
    ended.put((snap_id, batch, result))


def _ignore(_share: float) -> None:
    """A job's own progress: its end tells enough."""
