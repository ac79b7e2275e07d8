"""How likely the result is right: the mass of the winning mode, and how well it fits by itself."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from registration_core.kernels import Array32
from registration_core.modes import distances
from registration_core.selection import match_shares, shown_shares
from registration_core.snap_config import ConfidenceConfig
from registration_core.viewpoint_model import ViewpointModel

Array = NDArray[np.float64]


def modes_of(poses: Array32, model: ViewpointModel, radius: float) -> NDArray[np.intp]:
    """For each of the poses (N, 3, 4), best first, the index of the best pose whose mode it belongs to.

    Args:
        radius: poses whose MSSD is below this share of the diameter are one mode; symmetric twins are.
    """
    apart = np.empty((len(poses), len(poses)), np.float32)
    distances(poses, model.extremes, model.symmetries, apart)
    close = apart < radius * model.diameter
    np.fill_diagonal(close, True)
    mode = np.full(len(poses), -1, dtype=np.intp)
    for i in range(len(poses)):
        if mode[i] < 0:
            mode[close[i] & (mode < 0)] = i
    return mode


def mode_masses(scores: Array, modes: NDArray[np.intp]) -> Array:
    """Softmax (M,) over the best score of each mode, in the order of `np.unique(modes)`; scores are
    log-odds.
    """
    best = np.array([scores[modes == mode].max() for mode in np.unique(modes)])
    mass = np.exp(best - best.max())
    return mass / mass.sum()


def grouped(
    poses: Array32, winner: int, scores: Array, model: ViewpointModel, config: ConfidenceConfig
) -> tuple[NDArray[np.intp], Array]:
    """Indices of the modes among poses (N, 3, 4), the winner's first and then best first, and the mass of
    each.

    Args:
        scores: (N,), log-odds.
    """
    order = np.argsort(-scores, kind="stable")
    order = np.concatenate([[winner], order[order != winner]])
    modes = modes_of(poses[order], model, config.mode_radius)
    masses = mode_masses(scores[order], modes)
    best_first = np.concatenate([[0], 1 + np.argsort(-masses[1:], kind="stable")])
    return order[np.unique(modes)][best_first], masses[best_first]


def confidence(mass: float, score: float, counts: Array, config: ConfidenceConfig) -> float:
    """Probability in [0, 1] that the MSSD is below 5 % of the diameter: the belief in the winning mode, times
    how often a mode of such a score, match and visibility is right.

    Args:
        mass: share of the belief that the mode has.
        score: log-odds of the winner, as `selection.scores` gives them.
        counts: (evidence.COUNT,), of the winner.
    """
    match, shown = float(match_shares(counts[None])[0]), float(shown_shares(counts[None])[0])
    logit = config.intercept + config.score * score + config.match * match + config.shown * shown
    return mass * float(expit(logit))
