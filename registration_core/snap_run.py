"""One snap under way, in one view or in several at once.

Poses are those in the first view's camera: with one view the run is that view's search, and with several
every other view sees the same poses from where its camera stands. What the views say is added up.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from registration_core.geometry import pose
from registration_core.geometry.camera import Intrinsics
from registration_core.geometry.kernels import Array32, from_rows, to_rows
from registration_core.judge import selection
from registration_core.judge.certificates import Check, checked_by
from registration_core.judge.precision import surface_spreads
from registration_core.judge.selection import Judgement
from registration_core.search.modes import distinct, move_to_nearest_twin
from registration_core.search.polish import DAMPING, FINAL_TUKEY, MAX_STEP, MIN_WEIGHT
from registration_core.search.snap_input import SnapInput
from registration_core.view_search import ViewSearch

Array = NDArray[np.float64]

NEAR_TUKEY = ((0.03, 0.004), (0.015, 0.004), (0.008, 0.003))
"""Widths of the robust kernel, first and last step, of the polishes from the start itself, metres."""
NEAR_ITERATIONS = 14
"""Steps of each of them."""

JOINT_ITERATIONS, JOINT_TUKEY = 10, (0.015, 0.004)
"""Steps of the joint polish of a mode that one view has found, and widths of its robust kernel, metres."""


@dataclass(frozen=True, eq=False)
class Sighting:
    """A view that shows the object, and the search in it."""

    search: ViewSearch
    T_camera_first: Array
    """(4, 4), from the axes of the first view's camera."""

    def seen(self, poses: Array32) -> Array32:
        """Poses (N, 3, 4) in the first camera, in this one."""
        return to_rows(self.T_camera_first @ from_rows(poses))

    def found(self, poses: Array32) -> Array32:
        """Poses (N, 3, 4) in this camera, in the first one."""
        return to_rows(pose.inverse(self.T_camera_first) @ from_rows(poses))

    def systems(self, poses: Array32, tukey: float) -> tuple[Array, Array, Array]:
        """`ViewSearch.systems` of poses (N, 3, 4) in the first camera, in its axes."""
        hessians, sides, weights = self.search.systems(self.seen(poses), tukey)
        return self._to_first @ hessians @ self._to_first.T, sides @ self._to_first.T, weights

    @cached_property
    def _to_first(self) -> Array:
        """(6, 6), turns twists of this camera into those of the first one."""
        turned = np.zeros((6, 6))
        turned[:3, :3] = turned[3:, 3:] = self.T_camera_first[:3, :3].T
        return turned


@dataclass(frozen=True, eq=False)
class Witness:
    """A view that is not used: it is asked at the end whether it agrees."""

    depth: NDArray[np.float32]
    """(H, W), metres."""
    camera: Intrinsics
    T_camera_first: Array
    """(4, 4), from the axes of the first view's camera."""
    explained: NDArray[np.bool_] | None
    """(H, W), the pixels of known objects; None where there are none."""


@dataclass(frozen=True, eq=False)
class SnapRun:
    """Everything that the steps of one snap share."""

    sightings: tuple[Sighting, ...]
    """At least one; the first view's problem is the snap's."""
    seed: int
    started: float
    """`time.perf_counter()` at the start."""
    witnesses: tuple[Witness, ...] = ()

    @property
    def problem(self) -> SnapInput:
        """What is sought and from where, in the first camera."""
        return self.sightings[0].search.problem

    @property
    def evaluations(self) -> int:
        """Hypotheses compared with an image so far."""
        return sum(sighting.search.evaluations for sighting in self.sightings)

    def polished_start(self) -> Array32:
        """The operator's pose polished with kernels of several widths (3, 3, 4): the near candidates."""
        start = self.problem.prior.start[None]
        return np.concatenate([self._polished(start, NEAR_ITERATIONS, tukey) for tukey in NEAR_TUKEY])

    def round(self, share: float, widening: float) -> Iterator[Array32]:
        """`ViewSearch.round` in every view, side by side; what all stages leave is polished by all views."""
        if len(self.sightings) == 1:
            yield from self.sightings[0].search.round(share, widening)
            return
        rounds = [sighting.search.round(share / len(self.sightings), widening) for sighting in self.sightings]
        for stage, parts in enumerate(zip(*rounds, strict=True)):
            views = zip(self.sightings, parts, strict=True)
            poses = np.concatenate([sighting.found(part) for sighting, part in views])
            yield self._joined(poses, share) if stage == len(self.problem.config.stages) else poses

    def judge(self, candidates: Array32, counts: Array) -> Judgement:
        """Choose among poses (N, 3, 4), of evidence (N, COUNT): the start, its polishes, and other modes."""
        config = self.problem.config.selection
        return selection.judge(
            candidates, counts, len(NEAR_TUKEY), self.problem.prior, config, len(self.sightings)
        )

    def evidence(self, poses: Array32) -> Array:
        """What the pixels of all views together say of poses (N, 3, 4): (N, COUNT)."""
        return np.sum([one.search.evidence(one.seen(poses)) for one in self.sightings], axis=0)

    def checks(self, T: Array32) -> list[Check]:
        """What the pixels that each view's search left unread say of a pose (3, 4)."""
        return [one.search.check(from_rows(one.seen(T[None]))[0]) for one in self.sightings]

    def unused_checks(self, T: Array32) -> list[Check]:
        """What each view that was not used says of a pose (3, 4)."""
        centre = from_rows(T[None])[0]
        return [
            checked_by(
                one.depth, one.camera, self.problem.model, one.T_camera_first @ centre, False, one.explained
            )
            for one in self.witnesses
        ]

    def hessian(self, T: Array32) -> Array:
        """How firmly the depth of all views holds a pose (3, 4): (6, 6), as `polish.systems` scales it."""
        return self._systems(T[None], FINAL_TUKEY)[0][0]

    def spreads(self, poses: Array32) -> Array:
        """How far the surface at poses (N, 3, 4) may lie off, as `surface_spreads` gives it."""
        return surface_spreads(poses, self._systems(poses, FINAL_TUKEY)[0], self.problem.model)

    def _systems(self, poses: Array32, tukey: float) -> tuple[Array, Array, Array]:
        parts = [sighting.systems(poses, tukey) for sighting in self.sightings]
        hessians, sides, weights = (np.sum(part, axis=0) for part in zip(*parts, strict=True))
        return hessians, sides, weights

    def _joined(self, poses: Array32, share: float) -> Array32:
        """The distinct modes among poses (N, 3, 4) that single views have found, polished by all of them: as
        many as a round of this share leaves in one view, best first.
        """
        move_to_nearest_twin(poses, self.problem.model.symmetries, self.problem.prior.start)
        poses = self._polished(poses, JOINT_ITERATIONS, JOINT_TUKEY)
        last = self.problem.config.stages[-1]
        agreement = np.sum(
            [one.search.refined_weight(one.seen(poses), last) for one in self.sightings], axis=0
        )
        most = max(1, int(share * last.modes))
        return poses[distinct(poses, agreement, most, last.niche_translation, last.niche_rotation)]

    def _polished(self, poses: Array32, iterations: int, tukey: tuple[float, float]) -> Array32:
        """Poses (N, 3, 4) after Gauss-Newton steps on the normal equations of all views together; Tukey's
        kernel goes from a width of tukey[0] to tukey[1], metres.
        """
        if len(self.sightings) == 1:
            return self.sightings[0].search.polished(poses, iterations, tukey)
        search = self.sightings[0].search
        points, radius = search.surface.points.shape[2], search.problem.model.radius
        T = from_rows(poses)
        for width in np.geomspace(*tukey, iterations):
            hessians, sides, weights = self._systems(to_rows(T), width)
            held = weights > MIN_WEIGHT * points
            damped = hessians + (DAMPING * weights[:, None] + 1e-9)[:, :, None] * np.eye(6)
            steps = np.linalg.solve(damped, sides[:, :, None])[:, :, 0] * held[:, None]
            steps[:, 3:] /= radius
            lengths = [np.linalg.norm(part, axis=1) for part in (steps[:, :3], steps[:, 3:])]
            sizes = np.stack(lengths, axis=1)
            steps *= np.minimum(1.0, np.array(MAX_STEP) / (sizes + 1e-9)).min(axis=1)[:, None]
            T[:, :3, 3] += steps[:, :3]
            T[:, :3, :3] = Rotation.from_rotvec(steps[:, 3:]).as_matrix() @ T[:, :3, :3]
        return to_rows(T)
