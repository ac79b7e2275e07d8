"""How far the sparse agreement, which leads the search, ranks poses as the judgement on all pixels does."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from rich.console import Console
from rich.table import Table
from scipy.stats import spearmanr

from benchmarks.registration.instances import Instance
from benchmarks.registration.starts import Shell
from registration_core import SnapConfig
from registration_core.config import AgreementConfig
from registration_core.geometry.kernels import f4, to_rows
from registration_core.judge.pixel_evidence import evidence
from registration_core.judge.selection import scores
from registration_core.paper.particle_filter import Noise, initial_poses
from registration_core.search.observation import observe
from registration_core.search.snap_input import checked_problem
from registration_core.search.sparse_score import agreement_weights, sparse_score, surface_of

POSES, BEST = 1000, 0.01
"""About each true pose, and the share of them that counts as the best by the sparse agreement."""
SPREADS = (Shell(0.04, np.radians(30.0)), Shell(0.004, np.radians(3.0)))
"""Standard deviations of the poses for each axis: about as proposals are drawn, and as modes end."""
CONFIG = SnapConfig(agreement=AgreementConfig(prior=0.0))
"""Both rank by the image alone: a prior that they share would make them more alike."""
WEIGHINGS = {
    "proposals": (CONFIG.wide_points, 0.25, CONFIG.wide_epsilon, False, CONFIG.agreement.wide_softening),
    "last stage": (CONFIG.stages[-1].points, 1.0, CONFIG.stages[-1].epsilon, True, 1.0),
}
"""Points, share of the ring's, metres, whether with normals, softening: first and last in a snap."""


@dataclass(frozen=True)
class Ranking:
    """How one order of poses agrees with another."""

    correlation: float
    """Spearman's."""
    best_is_kept: bool
    """Whether the first by all pixels is among the BEST by the sparse agreement."""


def print_agreement(console: Console, instances: Sequence[Instance]) -> None:
    """A row for each spread of the poses and each weighing."""
    title = f"Sparse against exact agreement: {POSES:,} poses about the truth of {len(instances)} instances"
    table = Table(title=title, title_justify="left")
    for column in (
        "spread",
        "weighed as",
        "rank correlation, median",
        f"exact best in best {100 * BEST:.0f} %, %",
    ):
        table.add_column(column, justify="right")
    for spread in SPREADS:
        found = [rankings(instance, spread) for instance in instances]
        for name, own in zip(WEIGHINGS, zip(*found, strict=True), strict=True):
            median, kept = np.median([r.correlation for r in own]), np.mean([r.best_is_kept for r in own])
            table.add_row(str(spread), name, f"{median:.2f}", f"{100 * kept:.0f}")
    console.print(table)


def rankings(instance: Instance, spread: Shell) -> list[Ranking]:
    """Random poses about the truth, which is none of them, by each of WEIGHINGS against all pixels."""
    rng = np.random.default_rng(instance.seed)
    problem = checked_problem(instance.model, instance.depth, instance.camera, instance.truth, CONFIG, None)
    centre, model = problem.start[:3, 3], problem.model
    grid = observe(problem.depth, problem.camera, centre, model, CONFIG.observation, rng).grid
    noise = Noise(spread.translation, spread.rotation)
    poses = to_rows(initial_poses(problem.start, noise, 1 + POSES, rng)[1:])
    counts = evidence(poses, model, grid, float(centre[2]))
    exact = scores(counts, np.zeros(POSES), CONFIG.selection)
    surface, sparse, found = surface_of(model), np.empty(POSES, np.float32), []
    for points, ring_share, epsilon, with_normals, softening in WEIGHINGS.values():
        sparse_score(
            poses, surface, grid, problem.prior, points, int(ring_share * surface.ring.shape[2]), f4(epsilon),
            with_normals, agreement_weights(CONFIG.agreement, softening), sparse,
        )  # fmt: skip
        found.append(compared(sparse, exact))
    return found


def compared(sparse: ArrayLike, exact: ArrayLike) -> Ranking:
    """Two scores (N,) of the same poses."""
    sparse = np.asarray(sparse)
    better = np.count_nonzero(sparse > sparse[np.argmax(exact)])
    return Ranking(float(spearmanr(sparse, exact).statistic), bool(better < BEST * len(sparse)))
