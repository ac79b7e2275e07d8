"""Seconds, by one process with one thread on an otherwise idle machine."""

import time
from collections.abc import Sequence
from concurrent.futures import Executor

import numpy as np

from benchmarks.figures import Figure, Target
from benchmarks.registration.instances import Instance
from benchmarks.registration.methods import BEST_OF, DEFAULT, PAPER, polished_truth, register, warmed_up
from benchmarks.registration.objects import DATA, ycb_object
from benchmarks.registration.starts import SHELLS, starts
from benchmarks.registration.statistics import percentiles
from registration_core import SnapConfig
from registration_core.geometry.kernels import f4, to_rows
from registration_core.paper.particle_filter import Noise, initial_poses
from registration_core.search.observation import observe
from registration_core.search.snap_input import checked_problem
from registration_core.search.sparse_score import agreement_weights, sparse_score, surface_of
from registration_core.search.viewpoint_model import build_viewpoint_model

MEDIAN, P95, SPARSE, PAPER_RUN = Target(15.0), Target(30.0), Target(0.2), Target(10.0)
SPEEDUP = Target(40.0, at_least=True)
EVALUATIONS = 400_000
"""The paper's: 625 particles times 640 iterations."""
MODEL_OF_16K_FACES = 15
"""The YCB set's drill."""


def timings(pool: Executor, instances: Sequence[Instance], quick: bool) -> list[Figure]:
    """Figures from starts about synthetic instances of 640x480 pixels; the pool has nothing else to do."""
    return pool.submit(_timings, instances, quick).result()


def _timings(instances: Sequence[Instance], quick: bool) -> list[Figure]:
    warmed_up()
    for instance in instances:
        polished_truth(instance)  # builds the viewpoint model
    default = _seconds(DEFAULT, instances, 1)
    slow = instances[:1] if quick else instances[:: max(1, len(instances) // 10)]
    best_of = _seconds(BEST_OF, slow, 1)
    median, p95 = percentiles(default)
    figures = [
        Figure("a default snap at 640x480, one thread, median", 1000 * median, "ms", MEDIAN),
        Figure("the same, p95", 1000 * p95, "ms", P95),
        Figure("faster than the best of 32 Open3D ICP", percentiles(best_of)[0] / median, "times", SPEEDUP),
        Figure(f"{EVALUATIONS:,} sparse evaluations", _sparse_evaluations(instances[0]), "s", SPARSE),
    ]
    if not quick:
        paper = max(_seconds(PAPER, instances[:1], 1))
        figures.append(Figure("a whole paper() run, slowest of 4", paper, "s", PAPER_RUN))
    if DATA.is_dir():
        model = ycb_object(MODEL_OF_16K_FACES)
        began = time.perf_counter()
        build_viewpoint_model(model)
        seconds = time.perf_counter() - began
        figures.append(Figure(f"building the model of {len(model.faces):,} faces", seconds, "s"))
    return figures


def _seconds(method: str, instances: Sequence[Instance], count: int) -> list[float]:
    """Of so many starts on each shell about each instance."""
    return [
        register(method, one, T_start, shell, n).seconds
        for one in instances
        for shell in SHELLS
        for n, T_start in enumerate(starts(one.truth, one.model, one.camera, shell, count, one.seed))
    ]


def _sparse_evaluations(instance: Instance) -> float:
    """Of proposals, weighed as a snap weighs them first."""
    config, rng = SnapConfig(), np.random.default_rng(0)
    problem = checked_problem(instance.model, instance.depth, instance.camera, instance.truth, config, None)
    observation = observe(
        problem.depth, problem.camera, problem.start[:3, 3], problem.model, config.observation, rng
    )
    spread = Noise(config.spread.translation, config.spread.rotation)
    poses = to_rows(initial_poses(problem.start, spread, EVALUATIONS, rng))
    surface, agreement = surface_of(problem.model), np.empty(EVALUATIONS, np.float32)
    began = time.perf_counter()
    sparse_score(
        poses, surface, observation.grid, problem.prior, config.wide_points, surface.ring.shape[2] // 4,
        f4(config.wide_epsilon), False, agreement_weights(config.agreement), agreement,
    )  # fmt: skip
    return time.perf_counter() - began
