"""The same starts for every method, spread over the processors, one thread each."""

import multiprocessing
import os
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from benchmarks.registration.ambiguity import fits_as_well
from benchmarks.registration.instances import Instance
from benchmarks.registration.judging import Error, Judge
from benchmarks.registration.methods import polished_truth, register, warmed_up
from benchmarks.registration.starts import Shell, starts

Array = NDArray[np.float64]

THREAD_VARIABLES = ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


Plan = Mapping[Shell, Mapping[str, int]]
"""For each shell and method, from how many starts about an instance: always the first ones."""


@dataclass(frozen=True, eq=False)
class Trial:
    """What one method made of one start."""

    set_name: str
    scene: str
    instance: int
    """Index among all instances."""
    shell: Shell
    start: int
    method: str
    start_error: Error
    error: Error
    T_start: Array
    T_result: Array
    fits_elsewhere: bool
    """Wrong by ADD(-S), though depth fits there as well as at the truth: depth alone could not tell."""
    seconds: float
    confidence: float | None

    @property
    def claim(self) -> float:
        """The confidence, of a method that gives one."""
        assert self.confidence is not None, self.method
        return self.confidence


@dataclass(frozen=True, eq=False)
class InstanceTrials:
    """All trials of one instance."""

    trials: list[Trial]
    polish_error: Error
    """Where the polish ends that starts at the truth."""


def run_trials(
    pool: Executor, instances: Sequence[Instance], plans: Sequence[Plan], quick: bool, console: Console
) -> list[InstanceTrials]:
    """Every instance by its plan, in the order of the instances."""
    results: dict[int, InstanceTrials] = {}
    futures = {
        pool.submit(try_instance, instance, n, plan, quick): n
        for n, (instance, plan) in enumerate(zip(instances, plans, strict=True))
    }
    for future in as_completed(futures):
        results[futures[future]] = future.result()
        if len(results) % 10 == 0 or len(results) == len(instances):
            console.print(f"{len(results)} of {len(instances)} instances", style="dim")
    return [results[n] for n in sorted(results)]


@contextmanager
def single_threaded_pool() -> Iterator[Executor]:
    """A process for each processor, with one thread each, and none before there is work for it.

    They start anew: libraries read their number of threads only once.
    """
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))
    context = multiprocessing.get_context("spawn")
    try:
        with ProcessPoolExecutor(len(os.sched_getaffinity(0)), context) as pool:
            yield pool
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def try_instance(instance: Instance, number: int, plan: Plan, quick: bool) -> InstanceTrials:
    """Every method from the starts of one instance."""
    warmed_up()
    judge = Judge(instance.model)
    polish_error = judge.error(polished_truth(instance), instance.truth)  # builds the viewpoint model, too
    trials = []
    for shell, counts in plan.items():
        most = max(counts.values(), default=0)
        poses = starts(instance.truth, instance.model, instance.camera, shell, most, instance.seed)
        for n, T_start in enumerate(poses):
            start_error = judge.nearest_error(T_start, instance.truths)
            # side by side in time, too: what else the machine does slows all of them
            for method in (name for name, count in counts.items() if n < count):
                outcome = register(method, instance, T_start, shell, n, quick)
                error = judge.nearest_error(outcome.T_camera_object, instance.truths)
                trials.append(
                    Trial(
                        instance.set_name, instance.scene, number, shell, n, method, start_error,
                        error, T_start, outcome.T_camera_object,
                        not error.is_right and fits_as_well(instance, outcome.T_camera_object),
                        outcome.seconds, outcome.confidence,
                    )
                )  # fmt: skip
    return InstanceTrials(trials, polish_error)
