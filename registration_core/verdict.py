"""What a snap tells its caller, of one view or several: progress on the way, the estimate at the end."""

import time

import numpy as np
from numpy.typing import NDArray

from registration_core.agreement import heavy_tails
from registration_core.ambiguity import ambiguities
from registration_core.certificates import certified
from registration_core.confidence import belief_in_first, confidence, grouped
from registration_core.estimate import Estimate, Hypothesis, SnapStep
from registration_core.kernels import Array32, from_rows, to_rows
from registration_core.modes import distinct
from registration_core.polish import covariance, eased
from registration_core.problem import Problem
from registration_core.selection import Judgement, match_shares, scores
from registration_core.snap_run import SnapRun

Array = NDArray[np.float64]

UNSEEN_CONFIDENCE = 0.01
"""Where there is too little evidence: nothing speaks for the pose."""

PARTICLE_TEMPERATURE = 0.03
"""Difference of Eq. 5 between two modes of the particle filter that counts as one unit of log-odds."""


def progress(
    run: SnapRun, iteration: int, iterations: int, poses: Array32, score: float, counts: Array
) -> SnapStep:
    """A step with the hypotheses alive, (N, 3, 4), the one judged best first; its confidence takes that one's
    mode for the only.

    Args:
        score, counts: what the evidence says of the best.
    """
    return SnapStep(
        iteration,
        iterations,
        run.problem.uncentred(from_rows(poses[:1])[0]),
        confidence(1.0, score, counts, run.problem.config.confidence),
        run.problem.uncentred_particles(poses),
    )


def verdict(run: SnapRun, iteration: int, candidates: Array32, judgement: Judgement) -> SnapStep:
    """The last step of the fast method: the winner among the candidates (N, 3, 4), the start being the
    first.
    """
    winner = judgement.winner
    if winner > 0:
        candidates = candidates.copy()
        T, hessian = from_rows(candidates[[winner]])[0], run.hessian(candidates[winner])
        candidates[winner] = to_rows(eased(T, run.problem.start, hessian, run.problem.model.radius))[0]
    log_odds = _tempered(judgement.scores, run.problem)
    return _conclusion(run, iteration, candidates, winner, log_odds, *judgement.of_winner)


def certainty(run: SnapRun, candidates: Array32, judgement: Judgement) -> float:
    """The confidence that a `verdict` on these candidates (N, 3, 4) would have."""
    log_odds = _tempered(judgement.scores, run.problem)
    modes, masses = _modes(run.problem, candidates, judgement.winner, log_odds)
    mass = belief_in_first(modes, masses, run.problem.model)
    return confidence(mass, *judgement.of_winner, run.problem.config.confidence)


def outcome(run: SnapRun, iteration: int, particles: Array32, log_weights: Array) -> SnapStep:
    """The last step of the particle filter: Eq. 2 over its particles (N, 3, 4), best first."""
    kept = distinct(particles, -np.arange(len(particles), dtype=np.float32), 24, 0.003, 0.05)
    log_odds = np.exp(log_weights[kept]) / PARTICLE_TEMPERATURE
    return _conclusion(run, iteration, particles[kept], 0, log_odds, *judged(run, particles[0]))


def judged(run: SnapRun, T: Array32) -> tuple[float, Array]:
    """Score and counts (COUNT,) of a pose (3, 4)."""
    counts, tails = run.evidence(T[None]), heavy_tails(T[None], run.problem.prior)
    return float(scores(counts, tails, run.problem.config.selection)[0]), counts[0]


def nothing_seen(run: SnapRun, iteration: int) -> SnapStep:
    """The last step where evidence is too little: the operator's pose is kept, with low confidence."""
    start = run.problem.prior.start
    return _final(run, iteration, start[None], np.ones(1), UNSEEN_CONFIDENCE, False)


def found_anywhere(problem: Problem, candidates: Array32, counts: Array, most: int) -> tuple[Hypothesis, ...]:
    """At most so many modes of candidates (N, 3, 4), of evidence (N, COUNT), best first and each with its
    chance, where there is no start; none where nothing fits.
    """
    config = problem.config
    seen = match_shares(counts) >= config.selection.min_match
    if not seen.any():
        return ()
    candidates, counts = candidates[seen], counts[seen]
    values = scores(counts, np.zeros(len(candidates)), config.selection)
    log_odds = _tempered(values, problem)
    modes, masses = grouped(candidates, int(np.argmax(log_odds)), log_odds, problem.model, config.confidence)
    modes, masses = modes[:most], masses[:most]
    poses = problem.uncentred(from_rows(candidates[modes]))
    return tuple(
        Hypothesis(T, float(mass), confidence(float(mass), float(values[k]), counts[k], config.confidence))
        for T, mass, k in zip(poses, masses, modes, strict=True)
    )


def _conclusion(
    run: SnapRun,
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
    config = run.problem.config
    if match_shares(counts[None])[0] < config.selection.min_match:
        return nothing_seen(run, iteration)
    modes, masses = _modes(run.problem, candidates, winner, log_odds)
    mass = belief_in_first(modes, masses, run.problem.model)
    belief = confidence(mass, score, counts, config.confidence)
    return _final(run, iteration, modes, masses, belief, True)


def _final(
    run: SnapRun, iteration: int, modes: Array32, masses: Array, belief: float, converged: bool
) -> SnapStep:
    problem, model = run.problem, run.problem.model
    centred = from_rows(modes)
    poses = problem.uncentred(centred)
    if np.array_equal(modes[0], problem.prior.start):
        poses[0] = problem.T_camera_object  # kept as it came, without the rounding of float32
    hessian = run.hessian(modes[0])
    unknown = ambiguities(
        centred, masses, hessian, lambda T: run.evidence(to_rows(T)), model, problem.config.selection
    )
    estimate = Estimate(
        T_camera_object=poses[0],
        confidence=belief,
        covariance=covariance(hessian, poses[0][:3, :3], model.radius, model.centre),
        hypotheses=_hypotheses(poses, masses),
        ambiguities=unknown,
        certificates=certified(converged, bool(unknown), run.checks(modes[0]), run.unused_checks(modes[0])),
        seconds=time.perf_counter() - run.started,
        evaluations=run.evaluations,
        converged=converged,
        seed=run.seed,
    )
    return SnapStep(iteration, iteration, poses[0], belief, poses, estimate)


def _tempered(scores: Array, problem: Problem) -> Array:
    """Log-odds (N,) by which candidates of these scores (N,) share the belief."""
    return scores / problem.config.confidence.temperature


def _modes(problem: Problem, candidates: Array32, winner: int, log_odds: Array) -> tuple[Array32, Array]:
    """The modes (M, 3, 4) of candidates (N, 3, 4), the winner's first and then best first, and their
    masses (M,).
    """
    modes, masses = grouped(candidates, winner, log_odds, problem.model, problem.config.confidence)
    return candidates[modes], masses


def _hypotheses(poses: Array, masses: Array) -> tuple[Hypothesis, ...]:
    return tuple(Hypothesis(T, float(mass)) for T, mass in zip(poses, masses, strict=True))
