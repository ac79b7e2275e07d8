"""Choosing the winner without doing harm: the evidence of each candidate, a prior about the start, and a lead
that is demanded.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration_core import evidence
from registration_core.agreement import Prior, heavy_tails
from registration_core.kernels import Array32, squared_angle
from registration_core.snap_config import SelectionConfig

Array = NDArray[np.float64]

LEAST_CLAIM = 0.3
"""Share of the mean silhouette: no smaller a claim is trusted in `match_shares`."""
LEAST_OUTLINE = 0.05
"""The same for the outline in `shown_shares`."""
HIDDEN = [evidence.OFF_PLANE, evidence.OFF_PLANE + 1, evidence.ON_PLANE, evidence.ON_PLANE + 1]
"""Classes of pixels that something hides which lies clearly in front."""


@dataclass(frozen=True, eq=False)
class Judgement:
    """Scores of candidates (N) and which one won."""

    winner: int
    scores: Array
    """(N,), natural logarithm of odds, of all views together."""
    counts: Array
    """(N, evidence.COUNT), pixels of each class over the mean silhouette area at the start's depth, as a view
    has them on average."""
    of_winner: tuple[float, Array]
    """Its score in a view on average, and its counts (evidence.COUNT,)."""


def judge(
    candidates: Array32, counts: Array, near: int, prior: Prior, config: SelectionConfig, views: int = 1
) -> Judgement:
    """Choose among poses (N, 3, 4): the start first, then `near` polishes of it, then the modes found
    elsewhere.

    Args:
        counts: (N, evidence.COUNT), their evidence, summed over so many views.
    """
    tails = heavy_tails(candidates, prior)
    values, average = scores(counts, tails, config), counts / views
    winner = chosen(values, near, leads(candidates, average[0], config))
    of_winner = float(scores(average, tails, config)[winner]), average[winner]
    return Judgement(winner, values, average, of_winner)


def scores(counts: Array, tails: Array, config: SelectionConfig) -> Array:
    """Log-odds (N,) of candidates, up to a constant, of their counts (N, evidence.COUNT) and how far they are
    from the start, (N,) as `heavy_tails` gives it.
    """
    weights = np.array([*config.off_plane, *config.on_plane, config.unmeasured, *config.ring])
    return counts @ weights + config.match_share * match_shares(counts) - config.prior * tails


def leads(candidates: Array32, counts: Array, config: SelectionConfig) -> Array:
    """What each of the poses (N, 3, 4), the start first, must score more than the one that stands, (N,).

    Much where the start fits, by its counts (COUNT,), and the pose is another: the operator is probably right
    then, and a small correction does no harm.
    """
    fits = match_shares(counts[None])[0] > config.fit_match
    moved = np.linalg.norm(candidates[:, :, 3] - candidates[0, :, 3], axis=1)
    turned = np.array([squared_angle(T, candidates[0]) for T in candidates])
    aside = (moved > config.aside_translation) | (turned > config.aside_rotation**2)
    return np.where(fits & aside, config.lead_over_fit, config.lead)


def chosen(scores: Array, near: int, leads: Array) -> int:
    """The winner among the start, `near` polishes of it, and other modes, of scores and leads (N,).

    The best polish replaces the start only where it scores better by its lead, and another mode replaces what
    stands then only where it does so again: in doubt the operator is right.
    """
    winner, led = 0, scores - leads
    for first, last in ((1, 1 + near), (1 + near, len(scores))):
        if first < last:
            best = first + int(np.argmax(led[first:last]))
            if led[best] > scores[winner]:
                winner = best
    return winner


def is_settled(judgement: Judgement, candidates: Array32, config: SelectionConfig) -> bool:
    """Whether the winner among the start and its polishes, (N, 3, 4), fits so well and has moved so little
    that nothing else need be looked for.
    """
    start, winner = candidates[0], candidates[judgement.winner]
    moved = float(np.linalg.norm(winner[:, 3] - start[:, 3]))
    turned = float(np.sqrt(max(squared_angle(winner, start), 0.0)))
    return bool(
        match_shares(judgement.counts[[judgement.winner]])[0] > config.settled_match
        and moved < config.settled_translation
        and turned < config.settled_rotation
    )


def match_shares(counts: Array) -> Array:
    """Share (N,) of the surface claimed and not hidden that was measured where it is claimed, off the plane
    or on it.
    """
    on_plane = counts[:, evidence.ON_PLANE + 3]
    matched = counts[:, evidence.OFF_PLANE + 3 : evidence.OFF_PLANE + 6].sum(axis=1) + 0.5 * on_plane
    return matched / np.maximum(_claims(counts)[1], LEAST_CLAIM)


def shown_shares(counts: Array) -> Array:
    """Share (N,) of the outline's pixels that nothing in front hides."""
    outlines, shown = _claims(counts)
    return shown / np.maximum(outlines, LEAST_OUTLINE)


def _claims(counts: Array) -> tuple[Array, Array]:
    """Pixels within the outlines (N,), and those of them that are not hidden (N,)."""
    outlines = counts[:, : evidence.RING].sum(axis=1)
    return outlines, outlines - counts[:, HIDDEN].sum(axis=1)
