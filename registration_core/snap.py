"""Refine an operator's pose against a depth image: `q* = argmax_q P(q | q_u, o, Z_d)`.

The fast method weighs data-driven proposals with a sparse viewpoint model, keeps several modes alive while
it anneals and polishes them, and lets the winner replace the operator's pose only where the evidence asks
for it. The particle filter of Ye et al., "Human-in-the-loop Pose Estimation via Shared Autonomy" (IUI
2021), is kept as the reference.
"""

import time
from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from registration_core.config import SnapConfig
from registration_core.estimate import Estimate, SnapStep
from registration_core.geometry.camera import Intrinsics
from registration_core.geometry.kernels import to_rows
from registration_core.judge.confidence import confidence
from registration_core.paper.likelihood import RenderedLikelihood
from registration_core.paper.particle_filter import Noise, ParticleFilter, initial_poses
from registration_core.search.snap_input import checked_problem
from registration_core.search.viewpoint_model import Registrable
from registration_core.seeding import seed_of
from registration_core.snap_run import Sighting, SnapRun
from registration_core.verdict import judged, nothing_seen, outcome, progress, standing, verdict
from registration_core.view_search import search_of


def snap(
    model: Registrable,
    depth: ArrayLike,
    camera: Intrinsics,
    T_camera_object: ArrayLike,
    config: SnapConfig | None = None,
    rng: np.random.Generator | None = None,
    start_spread: tuple[float, float] | None = None,
    explained: ArrayLike | None = None,
    color: ArrayLike | None = None,
) -> Estimate:
    """Refine the operator's pose of an object against a depth image.

    Args:
        depth: (H, W), metres, 0 = no measurement.
        T_camera_object: (4, 4), the operator's pose.
        config: `SnapConfig()` where it is None.
        rng: the source of all randomness; fresh entropy where it is None. See `Estimate.seed`.
        start_spread: (metres, radians) by which the start may be off, from the last drag's size; None =
        unknown.
        explained: (H, W) booleans, pixels that objects of known pose account for (`explained_pixels`): they
        attract nothing, and hide what lies behind them.
        color: (H, W, 3) bytes, pixel by pixel of the same place and time as the depth, which
        `color_is_aligned` may tell; None where there is none.

    Raises:
        ValueError: naming the argument that is wrong, and how.
    """
    for step in snap_steps(
        model, depth, camera, T_camera_object, config, rng, start_spread, explained, color
    ):
        if step.estimate is not None:
            return step.estimate
    raise AssertionError("the last step carries the estimate")


def snap_steps(
    model: Registrable,
    depth: ArrayLike,
    camera: Intrinsics,
    T_camera_object: ArrayLike,
    config: SnapConfig | None = None,
    rng: np.random.Generator | None = None,
    start_spread: tuple[float, float] | None = None,
    explained: ArrayLike | None = None,
    color: ArrayLike | None = None,
) -> Iterator[SnapStep]:
    """`snap` step by step, so that a caller can show progress and stop early; the last step has the estimate.

    Inputs are checked at once, not when the first step is asked for.
    """
    started = time.perf_counter()
    config = SnapConfig() if config is None else config
    problem = checked_problem(model, depth, camera, T_camera_object, config, start_spread, explained, color)
    seed = seed_of(rng)
    rng = np.random.default_rng(seed)
    return steps_of(SnapRun((Sighting(search_of(problem, rng), np.eye(4)),), seed, started))


def steps_of(run: SnapRun) -> Iterator[SnapStep]:
    """The steps of a run by the method that its configuration asks for."""
    if not run.sightings[0].search.sees_enough:
        return iter([nothing_seen(run, 1)])
    is_filter = run.problem.config.method == "particle_filter"
    return _filter_steps(run) if is_filter else _viewpoint_steps(run)


def _viewpoint_steps(run: SnapRun) -> Iterator[SnapStep]:
    """The fast method: polish the start; until a candidate stands out, propose, anneal and polish ever fewer
    modes, and choose among all that were found.
    """
    config = run.problem.config
    iterations = 2 + len(config.rounds) * (1 + len(config.stages))
    candidates = np.concatenate([run.problem.prior.start[None], run.polished_start()])
    counts = run.evidence(candidates)
    now, iteration = standing(run, candidates, counts), 1
    yield progress(run, iteration, iterations, now.best, now.confidence)
    for one in config.rounds:
        if now.confidence > one.doubt:
            continue
        for poses in run.round(one.share, one.widening):
            iteration += 1
            yield progress(run, iteration, iterations, np.concatenate([now.best, poses]), now.confidence)
        candidates = np.concatenate([candidates, poses])
        counts = np.concatenate([counts, run.evidence(poses)])
        now = standing(run, candidates, counts)
    yield verdict(run, iteration + 1, now)


def _filter_steps(run: SnapRun) -> Iterator[SnapStep]:
    """The paper's method: importance resampling of particles weighed by Eq. 3 to 5."""
    search = run.sightings[0].search
    problem, config = search.problem, search.problem.config.particle_filter
    depth = problem.depth if problem.explained is None else np.where(problem.explained, 0.0, problem.depth)
    likelihood = RenderedLikelihood(
        problem.model, depth, problem.camera, problem.start[:3, 3],
        problem.config.observation.reach, config,
    )  # fmt: skip
    spread = Noise(*problem.spread)
    noise = Noise(config.noise_translation, config.noise_rotation)
    poses = initial_poses(problem.start, spread, config.particles, search.rng)
    particle_filter = ParticleFilter(likelihood, noise, poses, search.rng)
    for iteration in range(1, config.iterations + 1):
        particles = particle_filter.step()
        search.evaluations += config.particles
        order = np.argsort(-particles.log_weights, kind="stable")
        ranked = to_rows(particles.poses[order])
        if iteration < config.iterations:
            sure = confidence(1.0, *judged(run, ranked[0]), problem.config.confidence)
            yield progress(run, iteration, config.iterations, ranked, sure)
        else:
            yield outcome(run, iteration, ranked, particles.log_weights[order])
