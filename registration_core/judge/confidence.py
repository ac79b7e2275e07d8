"""How likely the result is right: the belief that lies near it, and how well it fits by itself."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit

from registration_core.config import ConfidenceConfig
from registration_core.geometry.kernels import Array32, from_rows
from registration_core.judge import pixel_evidence as evidence
from registration_core.judge.selection import match_shares, shown_shares
from registration_core.search.modes import distances
from registration_core.search.viewpoint_model import ViewpointModel

Array = NDArray[np.float64]

FEATURES = (
    *("intercept", "belief", "score", "match", "inner match", "shown"),
    *("contrast", "color", "color change", "precision"),
)
"""What speaks for a winner: 1, the logit of the share of the belief that lies within EXACT of it, its score
in log-odds, the share of its claim that was measured where it is claimed, the same away from rims, the share
that is not hidden, the share of its outline where the surface ends, how much of its outline was seen in
colour, in LEAST_COLORED and at most 1, the share of that where the colour changes, and how many times smaller
than EXACT the spread of its surface is, as a logarithm.
"""
EXACT = 0.05
"""MSSD below which a pose is right, share of the diameter."""
NO_MASS = 10.0
"""Log-odds behind the best from which on a candidate has no share of the belief worth counting."""
MOST_BELIEF = 0.998
"""No share of the belief counts as more: others were not looked at."""
LEAST_INNER = 0.1
"""Share of the mean silhouette: no smaller an inner part is trusted in its match."""
LEAST_RING = 0.1
"""The same for what was seen just outside the outline."""
LEAST_COLORED = 0.02
"""The same for what was seen of the outline's colours: the less there is, the less it says."""
LIKE_WEIGHT = 0.02
"""Modes with less than this share of the winner's mass are not compared with it."""
SAME_SURFACE = 0.03
"""Two poses put the same surface there if hardly a point is farther than this share of the diameter from the
other's surface; "hardly" is ..."""
ASTRAY = 0.02
"""... no more than this share of the points."""


@dataclass(frozen=True, eq=False)
class Modes:
    """Candidates in groups that are one mode each, the winner's first and then best first."""

    best: NDArray[np.intp]
    """(M,), the index of each mode's best candidate."""
    masses: Array
    """(M,), the share of the belief of each: the softmax over the best scores."""
    near: Array
    """(M,), the share of all candidates' belief that lies within EXACT of each mode's best."""


def modes_of(apart: Array32, radius: float) -> NDArray[np.intp]:
    """For each of N poses, best first, the index of the best pose whose mode it belongs to.

    Args:
        apart: (N, N), their MSSD, shares of the diameter.
        radius: poses that are less far apart are one mode; symmetric twins are.
    """
    close = apart < radius
    np.fill_diagonal(close, True)
    mode = np.full(len(apart), -1, dtype=np.intp)
    for i in range(len(apart)):
        if mode[i] < 0:
            mode[close[i] & (mode < 0)] = i
    return mode


def softmax(scores: Array) -> Array:
    """Shares (N,) of the belief, of log-odds (N,)."""
    belief = np.exp(scores - scores.max())
    return belief / belief.sum()


def grouped(
    poses: Array32, winner: int, scores: Array, model: ViewpointModel, config: ConfidenceConfig
) -> Modes:
    """The modes among poses (N, 3, 4) of these scores (N,), log-odds."""
    order = np.argsort(-scores, kind="stable")
    order = order[scores[order] > scores.max() - NO_MASS]
    order = np.concatenate([[winner], order[order != winner]])
    apart = np.empty((len(order), len(order)), np.float32)
    distances(poses[order], model.extremes, model.symmetries, apart)
    apart /= model.diameter
    modes = modes_of(apart, config.mode_radius)
    firsts = np.unique(modes)
    masses = softmax(np.array([scores[order][modes == first].max() for first in firsts]))
    near = np.where(apart[firsts] < EXACT, softmax(scores[order]), 0.0).sum(axis=1)
    ranks = np.concatenate([[0], 1 + np.argsort(-masses[1:], kind="stable")])
    return Modes(order[firsts[ranks]], masses[ranks], near[ranks])


def belief_in_first(modes: Modes, poses: Array32, model: ViewpointModel) -> float:
    """Share of the belief near the first of the modes, and near those that depth cannot tell from it.

    Args:
        poses: (M, 3, 4), the modes' best.
    """
    alike = np.concatenate([[0], twins_of_first(poses, modes.masses, model)])
    return min(1.0, float(modes.near[alike].sum()))


def twins_of_first(poses: Array32, masses: Array, model: ViewpointModel) -> NDArray[np.intp]:
    """Indices of the poses (M, 3, 4) that put the same surface there as the first one, whatever symmetries
    the object is said to have. Those of little mass (M,) are not looked at.
    """
    alike = 1 + np.flatnonzero(masses[1:] >= LIKE_WEIGHT * masses[0])
    for points in (model.extremes, model.sample):  # a few that move most tell nearly all apart
        if len(alike):
            alike = alike[_astray(poses, alike, points, model) <= ASTRAY]
    return alike


def _astray(poses: Array32, others: NDArray[np.intp], points: Array32, model: ViewpointModel) -> Array:
    """Share of the points (P, 3) of the surface that each of the other poses puts off the first one's."""
    rows = from_rows(poses)
    relative = np.linalg.inv(rows[0]) @ rows[others]
    moved = np.einsum("mij,pj->mpi", relative[:, :3, :3], points) + relative[:, None, :3, 3]
    apart, _ = model.surface_tree.query(moved.reshape(-1, 3), distance_upper_bound=0.1 * model.diameter)
    return np.mean(apart.reshape(len(others), -1) > SAME_SURFACE * model.diameter, axis=1)


def features(beliefs: Array, scores: Array, counts: Array, spreads: Array) -> Array:
    """The FEATURES (N, F) of winners with shares of the belief near them (N,), scores (N,), counts (N, COUNT)
    and spreads (N,).
    """
    inner = counts[:, : evidence.INSIDE_BINS]
    matched = inner[:, evidence.MATCHED] + inner[:, evidence.MATCHED_ON_PLANE]
    visible = inner.sum(axis=1) - inner[:, list(evidence.HIDDEN)].sum(axis=1)
    rings = counts[:, evidence.RING : evidence.BELOW].reshape(len(counts), -1, evidence.RING_BINS).sum(axis=1)
    ends = rings[:, list(evidence.ENDS)].sum(axis=1)
    changes = counts[:, evidence.COLOR_CHANGES]
    outline = changes + counts[:, evidence.COLOR_STEADY]
    return np.stack(
        [
            np.ones(len(counts)),
            logit(np.clip(beliefs, 1.0 - MOST_BELIEF, MOST_BELIEF)),
            scores,
            match_shares(counts),
            matched / np.maximum(visible, LEAST_INNER),
            shown_shares(counts),
            ends / np.maximum(rings.sum(axis=1), LEAST_RING),
            np.minimum(outline / LEAST_COLORED, 1.0),
            changes / np.maximum(outline, LEAST_COLORED),
            np.log(EXACT / spreads),
        ],
        axis=1,
    )


def confidence(belief: float, score: float, counts: Array, spread: float, config: ConfidenceConfig) -> float:
    """Probability in [0, 1] that the MSSD is below 5 % of the diameter.

    Args:
        belief: share of the belief near the winner, as `belief_in_first` gives it.
        score: log-odds of the winner, as `selection.scores` gives them.
        counts: (evidence.COUNT,), of the winner.
        spread: of its surface, as `precision.surface_spreads` gives it.
    """
    speaks = features(np.array([belief]), np.array([score]), counts[None], np.array([spread]))[0]
    return float(expit(speaks @ np.array(config.weights)))
