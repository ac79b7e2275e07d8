"""What a snap tells its caller: progress on the way, the estimate at the end."""

import time

import numpy as np
from numpy.typing import NDArray

from registration_core.confidence import confidence, mode_masses, modes_of
from registration_core.estimate import Estimate, Hypothesis, SnapStep
from registration_core.kernels import Array32, from_rows
from registration_core.modes import distinct
from registration_core.polish import covariance
from registration_core.search import Search
from registration_core.selection import Judgement, Residual, residual_shares

Array = NDArray[np.float64]

DEPTH_NOISE = 0.001
"""Metres: no covariance is computed from residuals smaller than this."""

UNSEEN_CONFIDENCE = 0.01
"""Where there is too little evidence: nothing speaks for the pose."""

FINAL_TUKEY = 0.006
"""Width of the robust kernel for the covariance, metres."""

PARTICLE_TEMPERATURE = 0.03
"""Difference of Eq. 5 between two modes of the particle filter that counts as one unit of log-odds."""


def progress(search: Search, iteration: int, iterations: int, poses: Array32) -> SnapStep:
    """A step with the hypotheses alive, (N, 3, 4), best first; its confidence takes the best one's mode for
    the only.
    """
    shares = _shares_of_best(search, poses)
    return SnapStep(
        iteration,
        iterations,
        search.problem.uncentred(from_rows(poses[:1])[0]),
        confidence(1.0, shares, search.problem.config.confidence),
        search.problem.uncentred_particles(poses),
    )


def verdict(search: Search, iteration: int, candidates: Array32, judgement: Judgement) -> SnapStep:
    """The last step of the fast method: the winner among the candidates (N, 3, 4)."""
    temperature = search.problem.config.confidence.temperature
    shares = judgement.shares[judgement.winner]
    return _conclusion(
        search, iteration, candidates, judgement.winner, judgement.scores / temperature, shares
    )


def outcome(search: Search, iteration: int, particles: Array32, log_weights: Array) -> SnapStep:
    """The last step of the particle filter: Eq. 2 over its particles (N, 3, 4), best first."""
    kept = distinct(particles, -np.arange(len(particles), dtype=np.float32), 24, 0.003, 0.05)
    scores = np.exp(log_weights[kept]) / PARTICLE_TEMPERATURE
    return _conclusion(search, iteration, particles[kept], 0, scores, _shares_of_best(search, particles))


def nothing_seen(search: Search, iteration: int) -> SnapStep:
    """The last step where evidence is too little: the operator's pose is kept, with low confidence."""
    start = search.problem.prior.start
    return _final(search, iteration, start[None], np.ones(1), UNSEEN_CONFIDENCE, False)


def _conclusion(
    search: Search, iteration: int, candidates: Array32, winner: int, scores: Array, shares: Array
) -> SnapStep:
    """The last step: candidates grouped into modes, the winner's first; scores (N,) are log-odds."""
    if shares[Residual.MATCH] + shares[Residual.PLANE_MATCH] < search.problem.config.selection.min_match:
        return nothing_seen(search, iteration)
    config = search.problem.config.confidence
    order = np.argsort(-scores, kind="stable")
    order = np.concatenate([[winner], order[order != winner]])
    modes = modes_of(candidates[order], search.problem.model, config.mode_radius)
    masses = mode_masses(scores[order], modes)
    belief = confidence(float(masses[0]), shares, config)
    others = 1 + np.argsort(-masses[1:], kind="stable")
    best_first = np.concatenate([[0], others])
    return _final(
        search, iteration, candidates[order[np.unique(modes)]][best_first], masses[best_first], belief, True
    )


def _final(
    search: Search, iteration: int, modes: Array32, masses: Array, belief: float, converged: bool
) -> SnapStep:
    problem = search.problem
    poses = [problem.uncentred(T) for T in from_rows(modes)]
    if np.array_equal(modes[0], problem.prior.start):
        poses[0] = problem.T_camera_object  # kept as it came, without the rounding of float32
    estimate = Estimate(
        T_camera_object=poses[0],
        confidence=belief,
        covariance=_covariance(search, modes[0]),
        hypotheses=tuple(Hypothesis(T, float(mass)) for T, mass in zip(poses, masses, strict=True)),
        seconds=time.perf_counter() - search.started,
        evaluations=search.evaluations,
        converged=converged,
        seed=search.seed,
    )
    return SnapStep(iteration, iteration, poses[0], belief, np.stack(poses), estimate)


def _shares_of_best(search: Search, poses: Array32) -> Array:
    problem = search.problem
    distance = float(problem.start[2, 3])
    return residual_shares(poses[:1], problem.model, search.observation.grid, distance)[0]


def _covariance(search: Search, T: Array32) -> Array:
    """Covariance (6, 6) at a pose (3, 4), moved from the centre of the object to the origin of its frame."""
    model = search.problem.model
    at_centre = covariance(T, search.surface, search.observation.grid, model.radius, FINAL_TUKEY, DEPTH_NOISE)
    x, y, z = T[:, :3].astype(np.float64) @ model.centre
    # t_origin = t_centre - R centre, and a small turn w moves R centre by w x (R centre)
    jacobian = np.eye(6)
    jacobian[:3, 3:] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    return jacobian @ at_centre @ jacobian.T
