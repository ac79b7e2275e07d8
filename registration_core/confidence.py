"""How likely the result is right: the mass of the winning mode, and how well it fits by itself."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit

from registration_core import evidence
from registration_core.kernels import Array32, from_rows
from registration_core.modes import distances
from registration_core.selection import match_shares, shown_shares
from registration_core.snap_config import ConfidenceConfig
from registration_core.viewpoint_model import ViewpointModel

Array = NDArray[np.float64]

FEATURES = ("intercept", "mass", "score", "match", "inner match", "shown", "contrast")
"""What speaks for a winner: 1, the logit of its mode's share of the belief, its score in log-odds, the share
of its claim that was measured where it is claimed, the same away from rims, the share that is not hidden, and
the share of its outline where the surface ends.
"""
NO_MASS = 10.0
"""Log-odds behind the best from which on a candidate has no share of the belief worth counting."""
MOST_MASS = 0.998
"""No share of the belief counts as more: others were not looked at."""
LEAST_INNER = 0.1
"""Share of the mean silhouette: no smaller an inner part is trusted in its match."""
LEAST_RING = 0.1
"""The same for what was seen just outside the outline."""
LIKE_WEIGHT = 0.02
"""Modes with less than this share of the winner's mass are not compared with it."""
SAME_SURFACE = 0.03
"""Two poses put the same surface there if hardly a point is farther than this share of the diameter from the
other's surface; "hardly" is ..."""
ASTRAY = 0.02
"""... no more than this share of the points."""


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
    order = order[scores[order] > scores.max() - NO_MASS]
    order = np.concatenate([[winner], order[order != winner]])
    modes = modes_of(poses[order], model, config.mode_radius)
    masses = mode_masses(scores[order], modes)
    best_first = np.concatenate([[0], 1 + np.argsort(-masses[1:], kind="stable")])
    return order[np.unique(modes)][best_first], masses[best_first]


def belief_in_first(poses: Array32, masses: Array, model: ViewpointModel) -> float:
    """Share of the belief that the first of the modes (M, 3, 4), of masses (M,), has together with those that
    depth cannot tell from it.
    """
    return float(masses[0] + masses[twins_of_first(poses, masses, model)].sum())


def twins_of_first(poses: Array32, masses: Array, model: ViewpointModel) -> NDArray[np.intp]:
    """Indices of the poses (M, 3, 4) that put the same surface there as the first one, whatever symmetries
    the object is said to have. Those of little mass are not looked at.
    """
    weighty = 1 + np.flatnonzero(masses[1:] >= LIKE_WEIGHT * masses[0])
    if not len(weighty):
        return weighty
    rows = from_rows(poses)
    relative = np.linalg.inv(rows[0]) @ rows[weighty]
    moved = np.einsum("mij,pj->mpi", relative[:, :3, :3], model.sample) + relative[:, None, :3, 3]
    apart, _ = model.surface_tree.query(moved.reshape(-1, 3), distance_upper_bound=0.1 * model.diameter)
    astray = np.mean(apart.reshape(len(weighty), -1) > SAME_SURFACE * model.diameter, axis=1)
    return weighty[astray <= ASTRAY]


def features(masses: Array, scores: Array, counts: Array) -> Array:
    """The FEATURES (N, F) of winners with shares of the belief (N,), scores (N,) and counts (N, COUNT)."""
    inner = counts[:, : evidence.INSIDE_BINS]
    matched = inner[:, evidence.MATCHED] + inner[:, evidence.MATCHED_ON_PLANE]
    visible = inner.sum(axis=1) - inner[:, list(evidence.HIDDEN)].sum(axis=1)
    rings = counts[:, evidence.RING : evidence.BELOW].reshape(len(counts), -1, evidence.RING_BINS).sum(axis=1)
    ends = rings[:, list(evidence.ENDS)].sum(axis=1)
    return np.stack(
        [
            np.ones(len(counts)),
            logit(np.clip(masses, 1.0 - MOST_MASS, MOST_MASS)),
            scores,
            match_shares(counts),
            matched / np.maximum(visible, LEAST_INNER),
            shown_shares(counts),
            ends / np.maximum(rings.sum(axis=1), LEAST_RING),
        ],
        axis=1,
    )


def confidence(mass: float, score: float, counts: Array, config: ConfidenceConfig) -> float:
    """Probability in [0, 1] that the MSSD is below 5 % of the diameter.

    Args:
        mass: share of the belief in the winning mode, as `belief_in_first` gives it.
        score: log-odds of the winner, as `selection.scores` gives them.
        counts: (evidence.COUNT,), of the winner.
    """
    speaks = features(np.array([mass]), np.array([score]), counts[None])[0]
    return float(expit(speaks @ np.array(config.weights)))
