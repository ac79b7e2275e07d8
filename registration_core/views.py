"""One pose against several views at once: modes of each view, polished and judged by all of them."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from registration_core import pose
from registration_core.agreement import Prior, heavy_tails, surface_of
from registration_core.ambiguity import ambiguities
from registration_core.camera import Intrinsics
from registration_core.confidence import confidence, grouped
from registration_core.estimate import Hypothesis, WorldEstimate
from registration_core.kernels import Array32, centred, from_rows, to_rows, uncentred
from registration_core.modes import distinct, move_to_nearest_twin
from registration_core.object_model import ObjectModel
from registration_core.observation import observe
from registration_core.polish import DAMPING, FINAL_TUKEY, MAX_STEP, MIN_WEIGHT, covariance, eased, systems
from registration_core.problem import OutOfViewError, checked_problem
from registration_core.report import UNSEEN_CONFIDENCE
from registration_core.search import NEAR_ITERATIONS, NEAR_TUKEY, Search
from registration_core.seeding import seed_of
from registration_core.selection import chosen, leads, match_shares, scores
from registration_core.snap_config import SnapConfig
from registration_core.viewpoint_model import ViewpointModel, viewpoint_model

Array = NDArray[np.float64]
View = tuple[ArrayLike, Intrinsics, ArrayLike]
"""Depth (H, W) in metres, its camera, and `T_world_camera` (4, 4)."""

JOINT_ITERATIONS, JOINT_TUKEY = 10, (0.015, 0.004)
"""Steps of the joint polish of a mode that one view has found, and widths of its robust kernel, metres."""
NICHE = (0.003, 0.05)
"""Modes closer than this are one, metres and radians."""
MODES = 32
"""Modes that are judged by all views."""


@dataclass(frozen=True, eq=False)
class Sighting:
    """A view that shows the object, with the search in it."""

    search: Search
    T_camera_world: Array
    """(4, 4)."""

    def rows(self, T_world: Array) -> Array32:
        """Poses (N, 4, 4) in the world as rows (N, 3, 4) in the camera."""
        return to_rows(self.T_camera_world @ T_world)

    def systems(self, T_world: Array, tukey: float) -> tuple[Array, Array, Array]:
        """`polish.systems` of poses (N, 4, 4) in the world, in world axes."""
        search = self.search
        hessians, sides, weights = systems(
            self.rows(T_world), search.surface, search.observation.grid, search.problem.model.radius,
            search.surface.points.shape[2], tukey,
        )  # fmt: skip
        to_world = np.kron(np.eye(2), self.T_camera_world[:3, :3].T)
        return to_world @ hessians @ to_world.T, sides @ to_world.T, weights

    def evidence(self, T_world: Array) -> Array:
        """Evidence (N, COUNT) of poses (N, 4, 4) in the world."""
        return self.search.evidence(self.rows(T_world))

    def modes(self) -> Array:
        """What the search in this view finds, (N, 4, 4), in the world."""
        *_, poses = self.search.round()
        return pose.inverse(self.T_camera_world) @ pose.orthonormalised(from_rows(poses))


def snap_views(
    model: ObjectModel,
    views: Sequence[View],
    T_world_object: ArrayLike,
    config: SnapConfig | None = None,
    rng: np.random.Generator | None = None,
    start_spread: tuple[float, float] | None = None,
) -> WorldEstimate:
    """Refine the operator's pose of an object against several depth images of a scene that stands still.

    Every view is searched in one whole round: there is no early stop.

    Args:
        views: depth (H, W) in metres, camera and `T_world_camera` (4, 4) of each; those whose image the
            object lies outside of are left out.
        T_world_object: (4, 4), the operator's pose.
        config: `SnapConfig()` where it is None; the fast method is the only one.
        rng: as for `snap`.
        start_spread: as for `snap`.

    Raises:
        ValueError: naming the argument that is wrong, and how.
    """
    started = time.perf_counter()
    config = SnapConfig() if config is None else config
    if len(views) == 0:
        raise ValueError("views must hold at least one view; there is none")
    if config.method != "viewpoint":
        raise ValueError("config.method must be 'viewpoint': the particle filter knows one view only")
    T_start = pose.checked(T_world_object, "T_world_object")
    seed = seed_of(rng)
    sightings = _sightings(model, views, T_start, config, np.random.default_rng(seed), seed, start_spread)
    known = viewpoint_model(model)
    start = centred(T_start, known.centre)
    seen = [s for s in sightings if s.search.observation.measured >= config.observation.min_pixels]
    if not seen:
        return _estimate(sightings, start[None], np.ones(1), UNSEEN_CONFIDENCE, False, seed, started)
    candidates = _candidates(seen, start, known)
    prior = seen[0].search.problem.prior
    tails = heavy_tails(to_rows(candidates), Prior(to_rows(start)[0], prior.translation, prior.rotation))
    counts = _evidence(seen, candidates)
    values = scores(counts, tails, config.selection)
    shares = counts / len(seen)
    demanded = leads(to_rows(candidates), shares[0], config.selection)
    winner = chosen(values, len(NEAR_TUKEY), demanded)
    if match_shares(shares[[winner]])[0] < config.selection.min_match:
        return _estimate(seen, start[None], np.ones(1), UNSEEN_CONFIDENCE, False, seed, started)
    if winner > 0:
        candidates[winner] = eased(
            candidates[winner], start, _hessian(seen, candidates[winner]), known.radius
        )
    modes, masses = grouped(
        to_rows(candidates), winner, values / config.confidence.temperature, known, config.confidence
    )
    score = float(scores(shares[[winner]], tails[[winner]], config.selection)[0])
    belief = confidence(float(masses[0]), score, shares[winner], config.confidence)
    return _estimate(seen, candidates[modes], masses, belief, True, seed, started)


def _sightings(
    model: ObjectModel,
    views: Sequence[View],
    T_world_object: Array,
    config: SnapConfig,
    rng: np.random.Generator,
    seed: int,
    start_spread: tuple[float, float] | None,
) -> list[Sighting]:
    found = []
    for number, (depth, camera, T_world_camera) in enumerate(views):
        T_camera_world = pose.inverse(pose.checked(T_world_camera, f"views[{number}]: T_world_camera"))
        try:
            problem = checked_problem(
                model, depth, camera, T_camera_world @ T_world_object, config, start_spread
            )
        except OutOfViewError:
            continue
        except ValueError as error:
            raise ValueError(f"views[{number}]: {error}") from error
        observation = observe(
            problem.depth, camera, problem.start[:3, 3], problem.model, config.observation, rng
        )
        search = Search(problem, observation, surface_of(problem.model), rng, seed, time.perf_counter())
        found.append(Sighting(search, T_camera_world))
    if not found:
        raise ValueError("T_world_object puts the object wholly outside the image of every view")
    return found


def _candidates(sightings: list[Sighting], start: Array, model: ViewpointModel) -> Array:
    """The start, its polishes, and the best modes of each view, polished by all, (N, 4, 4) in the world."""
    near = [_polished(start[None], sightings, NEAR_ITERATIONS, tukey) for tukey in NEAR_TUKEY]
    found = np.concatenate([sighting.modes() for sighting in sightings])
    rows = to_rows(found)
    move_to_nearest_twin(rows, model.symmetries, to_rows(start)[0])
    found = _polished(pose.orthonormalised(from_rows(rows)), sightings, JOINT_ITERATIONS, JOINT_TUKEY)
    counts = _evidence(sightings, found)
    agreement = match_shares(counts / len(sightings)).astype(np.float32)
    kept = distinct(to_rows(found), agreement, MODES, *NICHE)
    return np.concatenate([start[None], *near, found[kept]])


def _polished(poses: Array, sightings: list[Sighting], iterations: int, tukey: tuple[float, float]) -> Array:
    """Poses (N, 4, 4) after Gauss-Newton steps on the normal equations of all views together; Tukey's kernel
    goes from a width of tukey[0] to tukey[1], metres.
    """
    model = sightings[0].search.problem.model
    points = sightings[0].search.surface.points.shape[2]
    poses = poses.copy()
    for width in np.geomspace(*tukey, iterations):
        parts = [sighting.systems(poses, width) for sighting in sightings]
        hessians, sides, weights = (sum(part) for part in zip(*parts, strict=True))
        held = weights > MIN_WEIGHT * points
        damped = hessians + (DAMPING * weights[:, None] + 1e-9)[:, :, None] * np.eye(6)
        steps = np.linalg.solve(damped, sides[:, :, None])[:, :, 0] * held[:, None]
        steps[:, 3:] /= model.radius
        sizes = np.stack([np.linalg.norm(steps[:, :3], axis=1), np.linalg.norm(steps[:, 3:], axis=1)], axis=1)
        steps *= np.minimum(1.0, np.array(MAX_STEP) / (sizes + 1e-9)).min(axis=1)[:, None]
        poses[:, :3, 3] += steps[:, :3]
        poses[:, :3, :3] = Rotation.from_rotvec(steps[:, 3:]).as_matrix() @ poses[:, :3, :3]
    return poses


def _evidence(sightings: list[Sighting], T_world: Array) -> Array:
    """Evidence (N, COUNT) of poses (N, 4, 4) in all views together."""
    return np.sum([sighting.evidence(T_world) for sighting in sightings], axis=0)


def _hessian(sightings: list[Sighting], T_world: Array) -> Array:
    """The Hessian (6, 6) of all views together, as `polish.systems` scales it."""
    return np.sum([sighting.systems(T_world[None], FINAL_TUKEY)[0][0] for sighting in sightings], axis=0)


def _estimate(
    sightings: list[Sighting],
    modes: Array,
    masses: Array,
    belief: float,
    converged: bool,
    seed: int,
    started: float,
) -> WorldEstimate:
    problem = sightings[0].search.problem
    model = problem.model
    poses = [uncentred(T, model.centre) for T in modes]
    hypotheses = tuple(Hypothesis(T, float(mass)) for T, mass in zip(poses, masses, strict=True))
    hessian = _hessian(sightings, modes[0])
    return WorldEstimate(
        T_camera_object=poses[0],
        confidence=belief,
        covariance=covariance(hessian, modes[0][:3, :3], model.radius, model.centre),
        hypotheses=hypotheses,
        ambiguities=ambiguities(
            modes,
            masses,
            hessian,
            lambda T: _evidence(sightings, T),
            model,
            problem.config.selection,
        ),
        seconds=time.perf_counter() - started,
        evaluations=sum(sighting.search.evaluations for sighting in sightings),
        converged=converged,
        seed=seed,
    )
