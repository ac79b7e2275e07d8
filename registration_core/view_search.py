"""The search in one view: what it works on, and the moves of the fast method."""

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration_core.config import StageConfig
from registration_core.geometry.kernels import Array32, f4
from registration_core.judge.certificates import NOTHING, Check, checked_by
from registration_core.judge.pixel_evidence import evidence
from registration_core.search.modes import distinct, move_to_nearest_twin
from registration_core.search.observation import Observation, observe
from registration_core.search.polish import polish, systems
from registration_core.search.proposals import around_start
from registration_core.search.snap_input import SnapInput
from registration_core.search.sparse_score import (
    Prior,
    Surface,
    agreement_weights,
    sparse_score,
    surface_of,
)

Array = NDArray[np.float64]

SHOWN = 625
"""Proposals that are shown as progress, at most."""


@dataclass(eq=False)
class ViewSearch:
    """What a view shows of the object, and where it is looked for."""

    problem: SnapInput
    observation: Observation
    surface: Surface
    rng: np.random.Generator
    evaluations: int = 0
    """Hypotheses compared with the image so far."""

    @property
    def sees_enough(self) -> bool:
        """Whether there are measurements to register to."""
        return self.observation.measured >= self.problem.config.observation.min_pixels

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
        return ranked(poses, self.refined_weight(poses, stage), len(poses))

    def refined_weight(self, poses: Array32, stage: StageConfig) -> Array32:
        """Agreement (N,) of polished poses (N, 3, 4), as a stage has it."""
        ring = self.surface.ring.shape[2]
        return self._agreement(poses, stage.points, ring, stage.epsilon, 1.0, True)

    def polished(self, poses: Array32, iterations: int, tukey: tuple[float, float]) -> Array32:
        """Poses (N, 3, 4) after steps with all surface points; see `polish`."""
        self.evaluations += iterations * len(poses)
        points, radius = self.surface.points.shape[2], self.problem.model.radius
        return polish(poses, self.surface, self.observation.grid, radius, points, iterations, tukey)

    def check(self, T: Array) -> Check:
        """What the pixels that this search left unread say of a pose `T_camera_centre` (4, 4)."""
        problem = self.problem
        if self.observation.block == 1 or problem.config.method != "viewpoint":
            return NOTHING
        return checked_by(problem.depth, problem.camera, problem.model, T, True, problem.explained)

    def systems(self, poses: Array32, tukey: float) -> tuple[Array, Array, Array]:
        """The normal equations of poses (N, 3, 4) with all surface points; see `polish.systems`."""
        points, radius = self.surface.points.shape[2], self.problem.model.radius
        return systems(poses, self.surface, self.observation.grid, radius, points, tukey)

    def evidence(self, poses: Array32) -> Array:
        """What the pixels say of poses (N, 3, 4): (N, COUNT)."""
        self.evaluations += len(poses)
        distance = float(self.problem.start[2, 3])
        return evidence(poses, self.problem.model, self.observation.grid, distance)

    def _at_most(self, points: int) -> int:
        return min(points, self.surface.points.shape[2])

    def _agreement(
        self, poses: Array32, points: int, ring: int, epsilon: float, softening: float, with_normals: bool
    ) -> Array32:
        agreement = np.empty(len(poses), np.float32)
        sparse_score(
            poses, self.surface, self.observation.grid, self.problem.prior, self._at_most(points), ring,
            f4(epsilon), with_normals, agreement_weights(self.problem.config.agreement, softening), agreement,
        )  # fmt: skip
        self.evaluations += len(poses)
        return agreement


def search_of(problem: SnapInput, rng: np.random.Generator) -> ViewSearch:
    """The search for what a problem asks for, its depth image read around the start."""
    observation = observe(
        problem.depth, problem.camera, problem.start[:3, 3], problem.model, problem.config.observation, rng,
        problem.explained, problem.color,
    )  # fmt: skip
    return ViewSearch(problem, observation, surface_of(problem.model), rng)


def ranked(poses: Array32, scores: Array32, most: int) -> tuple[Array32, Array32]:
    """The `most` best poses (N, 3, 4) and their scores, best first."""
    order = np.arange(len(scores))
    if most < len(scores):
        order = np.sort(np.argpartition(-scores, most)[:most])  # in order of their drawing, for ties
    order = order[np.argsort(-scores[order], kind="stable")]
    return poses[order], scores[order]
