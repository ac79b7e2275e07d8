"""What a snap tells its caller: progress on the way, the estimate at the end."""

import time

import numpy as np
from numpy.typing import NDArray

from registration_core.agreement import heavy_tails
from registration_core.ambiguity import ambiguities
from registration_core.confidence import confidence, grouped
from registration_core.estimate import Estimate, Hypothesis, SnapStep
from registration_core.kernels import Array32, from_rows, to_rows
from registration_core.modes import distinct
from registration_core.polish import covariance, eased
from registration_core.search import Search
from registration_core.selection import Judgement, match_shares, scores

Array = NDArray[np.float64]

UNSEEN_CONFIDENCE = 0.01
"""Where there is too little evidence: nothing speaks for the pose."""

PARTICLE_TEMPERATURE = 0.03
"""Difference of Eq. 5 between two modes of the particle filter that counts as one unit of log-odds."""


def progress(
    search: Search, iteration: int, iterations: int, poses: Array32, score: float, counts: Array
) -> SnapStep:
    """A step with the hypotheses alive, (N, 3, 4), the one judged best first; its confidence takes that one's
    mode for the only.

    Args:
        score, counts: what the evidence says of the best.
    """
    return SnapStep(
        iteration,
        iterations,
        search.problem.uncentred(from_rows(poses[:1])[0]),
        confidence(1.0, score, counts, search.problem.config.confidence),
        search.problem.uncentred_particles(poses),
    )


def verdict(search: Search, iteration: int, candidates: Array32, judgement: Judgement) -> SnapStep:
    """The last step of the fast method: the winner among the candidates (N, 3, 4), the start being the
    first.
    """
    temperature = search.problem.config.confidence.temperature
    winner, (score, counts) = judgement.winner, judgement.of_winner
    if winner > 0:
        candidates = candidates.copy()
        T, hessian = from_rows(candidates[[winner]])[0], search.hessian(candidates[winner])
        candidates[winner] = to_rows(eased(T, search.problem.start, hessian, search.problem.model.radius))[0]
    return _conclusion(search, iteration, candidates, winner, judgement.scores / temperature, score, counts)


def certainty(search: Search, candidates: Array32, judgement: Judgement) -> float:
    """The confidence that a `verdict` on these candidates (N, 3, 4) would have."""
    config = search.problem.config.confidence
    scores = judgement.scores / config.temperature
    _, masses = grouped(candidates, judgement.winner, scores, search.problem.model, config)
    return confidence(float(masses[0]), *judgement.of_winner, config)


def outcome(search: Search, iteration: int, particles: Array32, log_weights: Array) -> SnapStep:
    """The last step of the particle filter: Eq. 2 over its particles (N, 3, 4), best first."""
    kept = distinct(particles, -np.arange(len(particles), dtype=np.float32), 24, 0.003, 0.05)
    log_odds = np.exp(log_weights[kept]) / PARTICLE_TEMPERATURE
    return _conclusion(search, iteration, particles[kept], 0, log_odds, *judged(search, particles[0]))


def judged(search: Search, T: Array32) -> tuple[float, Array]:
    """Score and counts (COUNT,) of a pose (3, 4)."""
    counts, tails = search.evidence(T[None]), heavy_tails(T[None], search.problem.prior)
    return float(scores(counts, tails, search.problem.config.selection)[0]), counts[0]


def nothing_seen(search: Search, iteration: int) -> SnapStep:
    """The last step where evidence is too little: the operator's pose is kept, with low confidence."""
    start = search.problem.prior.start
    return _final(search, iteration, start[None], np.ones(1), UNSEEN_CONFIDENCE, False)


def _conclusion(
    search: Search,
    iteration: int,
    candidates: Array32,
    winner: int,
    log_odds: Array,
    score: float,
    counts: Array,
) -> SnapStep:
    """The last step: candidates grouped into modes, the winner's first.

    Args:
        log_odds: (N,), by which the candidates share the belief.
        score, counts: what the evidence says of the winner.
    """
    if match_shares(counts[None])[0] < search.problem.config.selection.min_match:
        return nothing_seen(search, iteration)
    config = search.problem.config.confidence
    modes, masses = grouped(candidates, winner, log_odds, search.problem.model, config)
    belief = confidence(float(masses[0]), score, counts, config)
    return _final(search, iteration, candidates[modes], masses, belief, True)


def _final(
    search: Search, iteration: int, modes: Array32, masses: Array, belief: float, converged: bool
) -> SnapStep:
    problem = search.problem
    centred = from_rows(modes)
    poses = problem.uncentred(centred)
    if np.array_equal(modes[0], problem.prior.start):
        poses[0] = problem.T_camera_object  # kept as it came, without the rounding of float32
    hypotheses = tuple(Hypothesis(T, float(mass)) for T, mass in zip(poses, masses, strict=True))
    hessian, model = search.hessian(modes[0]), problem.model
    estimate = Estimate(
        T_camera_object=poses[0],
        confidence=belief,
        covariance=covariance(hessian, poses[0][:3, :3], model.radius, model.centre),
        hypotheses=hypotheses,
        ambiguities=ambiguities(
            centred,
            masses,
            hessian,
            lambda T: search.evidence(to_rows(T)),
            model,
            problem.config.selection,
        ),
        seconds=time.perf_counter() - search.started,
        evaluations=search.evaluations,
        converged=converged,
        seed=search.seed,
    )
    return SnapStep(iteration, iteration, poses[0], belief, poses, estimate)
