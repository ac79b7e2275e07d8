"""One snap under way: what it works on, and the moves of the fast method."""

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration_core.agreement import Prior, Surface, agreement_weights, sparse_agreement
from registration_core.evidence import evidence
from registration_core.kernels import Array32, f4
from registration_core.modes import distinct, move_to_nearest_twin
from registration_core.observation import Observation
from registration_core.polish import FINAL_TUKEY, polish, systems
from registration_core.problem import Problem
from registration_core.proposals import around_start
from registration_core.snap_config import StageConfig

Array = NDArray[np.float64]

NEAR_TUKEY = ((0.03, 0.004), (0.015, 0.004), (0.008, 0.003))
"""Widths of the robust kernel, first and last step, of the polishes from the start itself, metres."""
NEAR_ITERATIONS = 14
"""Steps of each of them."""

SHOWN = 625
"""Proposals that are shown as progress, at most."""


@dataclass(eq=False)
class Search:
    """Everything that the steps of one snap share."""

    problem: Problem
    observation: Observation
    surface: Surface
    rng: np.random.Generator
    seed: int
    started: float
    """`time.perf_counter()` at the start."""
    evaluations: int = 0
    """Hypotheses compared with the image so far."""

    def round(self, share: float = 1.0, widening: float = 1.0) -> Iterator[Array32]:
        """Proposals, and then the modes (N, 3, 4) that every stage leaves, best first.

        Args:
            share: of all proposals that are drawn, and of all modes that are kept.
            widening: proposals are drawn this many times wider than the search is said to go.
        """
        config = self.problem.config
        share = min(1.0, max(0.0, share))
        count = max(1, round(share * self._most_proposals()))
        start, translation, rotation = self.problem.search
        wide = Prior(start, f4(widening * translation), f4(widening * rotation))
        poses = around_start(wide, self.surface, self.observation.grid, config.proposals, count, self.rng)
        poses, agreement = ranked(poses, self.weighed(poses), max(1, int(share * config.wide_kept)))
        yield poses[:SHOWN]
        for stage in config.stages:
            fewer = dataclasses.replace(stage, modes=max(1, int(share * stage.modes)))
            poses, agreement = self.refined(poses, agreement, fewer)
            yield poses

    def _most_proposals(self) -> int:
        """Fewer where the caller says that the start is close."""
        config, (translation, rotation) = self.problem.config, self.problem.spread
        share = translation * rotation / (config.spread.translation * config.spread.rotation)
        return round(min(1.0, max(config.proposals.least_share, share)) * config.proposals.count)

    def weighed(self, poses: Array32) -> Array32:
        """Agreement (N,) of proposals (N, 3, 4), of which none is exact yet."""
        config = self.problem.config
        ring = self.surface.ring.shape[2] // 4
        softening = config.agreement.wide_softening
        return self._agreement(poses, config.wide_points, ring, config.wide_epsilon, softening, False)

    def refined(self, poses: Array32, scores: Array32, stage: StageConfig) -> tuple[Array32, Array32]:
        """The distinct modes among poses (N, 3, 4), polished and weighed anew, best first."""
        model = self.problem.model
        if len(model.symmetries) > 1:
            poses = poses.copy()
            move_to_nearest_twin(poses, model.symmetries, self.problem.prior.start)
        kept = distinct(poses, scores, stage.modes, stage.niche_translation, stage.niche_rotation)
        tukey = (stage.tukey_start, stage.tukey_end)
        points = self._at_most(stage.points)
        poses = polish(
            poses[kept], self.surface, self.observation.grid, model.radius, points, stage.iterations, tukey
        )
        self.evaluations += len(poses) * stage.iterations
        ring = self.surface.ring.shape[2]
        return ranked(poses, self._agreement(poses, stage.points, ring, stage.epsilon, 1.0, True), len(poses))

    def polished_start(self) -> Array32:
        """The operator's pose polished with kernels of several widths (3, 3, 4): the near candidates."""
        start = self.problem.prior.start[None]
        points = self._at_most(self.surface.points.shape[2])
        self.evaluations += NEAR_ITERATIONS * len(NEAR_TUKEY)
        return np.concatenate(
            [
                polish(
                    start, self.surface, self.observation.grid, self.problem.model.radius, points,
                    NEAR_ITERATIONS, tukey,
                )
                for tukey in NEAR_TUKEY
            ]
        )  # fmt: skip

    def evidence(self, poses: Array32) -> Array:
        """What the pixels say of poses (N, 3, 4): (N, COUNT)."""
        self.evaluations += len(poses)
        distance = float(self.problem.start[2, 3])
        return evidence(poses, self.problem.model, self.observation.grid, distance)

    def hessian(self, T: Array32) -> Array:
        """How firmly the depth holds a pose (3, 4): (6, 6), as `polish.systems` scales it."""
        points, radius = self.surface.points.shape[2], self.problem.model.radius
        return systems(T[None], self.surface, self.observation.grid, radius, points, FINAL_TUKEY)[0][0]

    def _at_most(self, points: int) -> int:
        return min(points, self.surface.points.shape[2])

    def _agreement(
        self, poses: Array32, points: int, ring: int, epsilon: float, softening: float, with_normals: bool
    ) -> Array32:
        agreement = np.empty(len(poses), np.float32)
        sparse_agreement(
            poses, self.surface, self.observation.grid, self.problem.prior, self._at_most(points), ring,
            f4(epsilon), with_normals, agreement_weights(self.problem.config.agreement, softening), agreement,
        )  # fmt: skip
        self.evaluations += len(poses)
        return agreement


def ranked(poses: Array32, scores: Array32, most: int) -> tuple[Array32, Array32]:
    """The `most` best poses (N, 3, 4) and their scores, best first."""
    order = np.arange(len(scores))
    if most < len(scores):
        order = np.sort(np.argpartition(-scores, most)[:most])  # in order of their drawing, for ties
    order = order[np.argsort(-scores[order], kind="stable")]
    return poses[order], scores[order]
