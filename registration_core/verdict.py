"""What a snap tells its caller, of one view or several: progress on the way, the estimate at the end."""

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration_core.estimate import Estimate, Hypothesis, SnapStep
from registration_core.geometry.kernels import Array32, from_rows, to_rows
from registration_core.judge.ambiguity import ambiguities
from registration_core.judge.certificates import certified
from registration_core.judge.confidence import Modes, belief_in_first, confidence, grouped
from registration_core.judge.precision import surface_spreads
from registration_core.judge.selection import Judgement, match_shares, scores
from registration_core.search.modes import distinct
from registration_core.search.polish import FINAL_TUKEY, covariance, eased
from registration_core.search.sparse_score import heavy_tails
from registration_core.snap_run import SnapRun
from registration_core.view_search import ViewSearch

Array = NDArray[np.float64]

UNSEEN_CONFIDENCE = 0.01
"""Where there is too little evidence: nothing speaks for the pose."""

PARTICLE_TEMPERATURE = 0.03
"""Difference of Eq. 5 between two modes of the particle filter that counts as one unit of log-odds."""


@dataclass(frozen=True, eq=False)
class Standing:
    """What the candidates so far come to."""

    candidates: Array32
    """(N, 3, 4), the start first."""
    judgement: Judgement
    modes: Modes
    """The winner's first."""
    confidence: float

    @property
    def best(self) -> Array32:
        """(1, 3, 4), the winner."""
        return self.candidates[[self.judgement.winner]]


def standing(run: SnapRun, candidates: Array32, counts: Array) -> Standing:
    """What candidates (N, 3, 4) of evidence (N, COUNT) come to: the start, its polishes, and other modes."""
    judgement, config = run.judge(candidates, counts), run.problem.config.confidence
    log_odds = judgement.scores / config.temperature
    modes = grouped(candidates, judgement.winner, log_odds, run.problem.model, config)
    belief = belief_in_first(modes, candidates[modes.best], run.problem.model)
    spread = float(run.spreads(candidates[[judgement.winner]])[0])
    return Standing(candidates, judgement, modes, confidence(belief, *judgement.of_winner, spread, config))


def progress(run: SnapRun, iteration: int, iterations: int, poses: Array32, sure: float) -> SnapStep:
    """A step with the hypotheses alive, (N, 3, 4), the one judged best first, and how sure that one is."""
    return SnapStep(
        iteration,
        iterations,
        run.problem.uncentred(from_rows(poses[:1])[0]),
        sure,
        run.problem.uncentred_particles(poses),
    )


def verdict(run: SnapRun, iteration: int, last: Standing) -> SnapStep:
    """The last step of the fast method: the winner, eased towards the start where nothing holds it."""
    modes = last.candidates[last.modes.best]
    if last.judgement.winner > 0:
        T, hessian = from_rows(last.best)[0], run.hessian(last.best[0])
        modes[0] = to_rows(eased(T, run.problem.start, hessian, run.problem.model.radius))[0]
    _, counts = last.judgement.of_winner
    return _conclusion(run, iteration, modes, last.modes.masses, last.confidence, counts)


def outcome(run: SnapRun, iteration: int, particles: Array32, log_weights: Array) -> SnapStep:
    """The last step of the particle filter: Eq. 2 over its particles (N, 3, 4), best first."""
    model, config = run.problem.model, run.problem.config.confidence
    kept = distinct(particles, -np.arange(len(particles), dtype=np.float32), 24, 0.003, 0.05)
    log_odds = np.exp(log_weights[kept]) / PARTICLE_TEMPERATURE
    modes = grouped(particles[kept], 0, log_odds, model, config)
    poses = particles[kept[modes.best]]
    score, counts, spread = judged(run, particles[0])
    sure = confidence(belief_in_first(modes, poses, model), score, counts, spread, config)
    return _conclusion(run, iteration, poses, modes.masses, sure, counts)


def judged(run: SnapRun, T: Array32) -> tuple[float, Array, float]:
    """Score, counts (COUNT,) and spread of a pose (3, 4)."""
    counts, tails = run.evidence(T[None]), heavy_tails(T[None], run.problem.prior)
    score = float(scores(counts, tails, run.problem.config.selection)[0])
    return score, counts[0], float(run.spreads(T[None])[0])


def nothing_seen(run: SnapRun, iteration: int) -> SnapStep:
    """The last step where evidence is too little: the operator's pose is kept, with low confidence."""
    start = run.problem.prior.start
    return _final(run, iteration, start[None], np.ones(1), UNSEEN_CONFIDENCE, False)


def found_anywhere(search: ViewSearch, candidates: Array32, most: int) -> tuple[Hypothesis, ...]:
    """At most so many modes of candidates (N, 3, 4), best first and each with its chance, where there is no
    start; none where nothing fits.
    """
    problem, config, counts = search.problem, search.problem.config, search.evidence(candidates)
    seen = match_shares(counts) >= config.selection.min_match
    if not seen.any():
        return ()
    candidates, counts = candidates[seen], counts[seen]
    values = scores(counts, np.zeros(len(candidates)), config.selection)
    log_odds = values / config.confidence.temperature
    modes = grouped(candidates, int(np.argmax(log_odds)), log_odds, problem.model, config.confidence)
    best = candidates[modes.best[:most]]
    spreads = surface_spreads(best, search.systems(best, FINAL_TUKEY)[0], problem.model)
    found = zip(
        problem.uncentred(from_rows(best)), modes.best, modes.masses, modes.near, spreads, strict=False
    )
    return tuple(
        Hypothesis(
            T, float(mass), confidence(near, float(values[k]), counts[k], float(spread), config.confidence)
        )
        for T, k, mass, near, spread in found
    )


def _conclusion(
    run: SnapRun, iteration: int, modes: Array32, masses: Array, sure: float, counts: Array
) -> SnapStep:
    """The last step: the modes (M, 3, 4), the winner's first, with their masses (M,).

    Args:
        counts: (COUNT,), what the evidence says of the winner.
    """
    if match_shares(counts[None])[0] < run.problem.config.selection.min_match:
        return nothing_seen(run, iteration)
    return _final(run, iteration, modes, masses, sure, True)


def _final(
    run: SnapRun, iteration: int, modes: Array32, masses: Array, sure: float, converged: bool
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
        confidence=sure,
        covariance=covariance(hessian, poses[0][:3, :3], model.radius, model.centre),
        hypotheses=_hypotheses(poses, masses),
        ambiguities=unknown,
        certificates=certified(converged, bool(unknown), run.checks(modes[0]), run.unused_checks(modes[0])),
        seconds=time.perf_counter() - run.started,
        evaluations=run.evaluations,
        converged=converged,
        seed=run.seed,
    )
    return SnapStep(iteration, iteration, poses[0], sure, poses, estimate)


def _hypotheses(poses: Array, masses: Array) -> tuple[Hypothesis, ...]:
    return tuple(Hypothesis(T, float(mass)) for T, mass in zip(poses, masses, strict=True))
