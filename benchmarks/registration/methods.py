"""Everything that is measured side by side, under one signature."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from benchmarks.registration import peers, prototype
from benchmarks.registration.instances import Instance
from benchmarks.registration.starts import Shell
from registration_core import SnapConfig, snap, warm_up
from registration_core.config import ParticleFilterConfig
from registration_core.geometry import pose
from registration_core.geometry.kernels import from_rows, to_rows
from registration_core.judge.selection import match_shares, shown_shares
from registration_core.search.snap_input import checked_problem
from registration_core.snap_run import Sighting, SnapRun
from registration_core.verdict import judged
from registration_core.view_search import search_of

Array = NDArray[np.float64]

NOTHING, ICP, BEST_OF, GICP = "no-op", "Open3D ICP", "Open3D ICP, best of 32", "small_gicp GICP"
PROTOTYPE = "research prototype"
PAPER, DEFAULT, TOLD = "paper()", "default", "default, spread told"
METHODS = (NOTHING, ICP, BEST_OF, GICP, PROTOTYPE, PAPER, DEFAULT, TOLD)
PEERS = (GICP, BEST_OF, PROTOTYPE)
"""Whose success and time the default has to beat."""

STARTS_OF_BEST = 32
SHORT_PAPER = SnapConfig(method="particle_filter", particle_filter=ParticleFilterConfig(50, 5))
"""The same code as `SnapConfig.paper()`, for a quick run."""


def available_methods() -> tuple[str, ...]:
    """METHODS without the prototype where that does not lie beside the project."""
    return tuple(name for name in METHODS if name != PROTOTYPE or prototype.is_there())


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a method made of a start."""

    T_camera_object: Array
    seconds: float
    confidence: float | None = None


def register(
    method: str, instance: Instance, T_start: Array, shell: Shell, seed: int, quick: bool = False
) -> Outcome:
    """Run one of METHODS from one start (4, 4); only `TOLD` and `BEST_OF` learn the shell's size."""
    if method in (PAPER, DEFAULT, TOLD):
        config = SnapConfig() if method != PAPER else SHORT_PAPER if quick else SnapConfig.paper()
        spread = (shell.translation, shell.rotation) if method == TOLD else None
        return _snapped(instance, T_start, config, spread, seed)
    if method == PROTOTYPE:
        prototype.prepare(instance.model)
    align: Callable[[], Array] = {
        NOTHING: lambda: T_start,
        ICP: lambda: peers.open3d_icp(instance, T_start),
        BEST_OF: lambda: peers.open3d_best_of(instance, T_start, shell, STARTS_OF_BEST, seed),
        GICP: lambda: peers.gicp(instance, T_start),
        PROTOTYPE: lambda: prototype.prototype_snap(instance, T_start, seed),
    }[method]
    began = time.perf_counter()
    T = align()
    return Outcome(T, time.perf_counter() - began)


def _snapped(
    instance: Instance, T_start: Array, config: SnapConfig, spread: tuple[float, float] | None, seed: int
) -> Outcome:
    color = instance.aligned_color  # read before the time counts
    began = time.perf_counter()
    estimate = snap(
        instance.model, instance.depth, instance.camera, T_start, config, np.random.default_rng(seed), spread,
        color=color,
    )  # fmt: skip
    return Outcome(estimate.T_camera_object, time.perf_counter() - began, estimate.confidence)


@dataclass(frozen=True)
class Opinion:
    """What the judgement of a snap says of one pose."""

    score: float
    """Log-odds, up to a constant."""
    match: float
    """Share of the claimed surface, as far as it is not hidden, that was measured where it is claimed."""
    shown: float
    """Share of the outline's pixels that nothing hides."""


def opinion(instance: Instance, T_start: Array, T: Array) -> Opinion:
    """What a snap from one pose (4, 4) would say of another."""
    centred = T @ pose.from_rotation_translation(np.eye(3), instance.model.centre)
    score, counts, _ = judged(_run(instance, T_start), to_rows(centred[None])[0])
    return Opinion(score, float(match_shares(counts[None])[0]), float(shown_shares(counts[None])[0]))


def polished_truth(instance: Instance) -> Array:
    """Where the finest polish of a snap ends when it starts at the truth: what the noise allows."""
    run = _run(instance, instance.truth)
    return run.problem.uncentred(from_rows(run.polished_start()[-1:])[0])


def _run(instance: Instance, T_start: Array) -> SnapRun:
    problem = checked_problem(
        instance.model, instance.depth, instance.camera, T_start, SnapConfig(), None, None,
        instance.aligned_color,
    )  # fmt: skip
    return SnapRun((Sighting(search_of(problem, np.random.default_rng(0)), np.eye(4)),), 0, 0.0)


@cache
def warmed_up() -> None:
    """Load all kernels, once a process."""
    warm_up()
