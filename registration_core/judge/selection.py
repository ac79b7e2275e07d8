"""Choosing the winner without doing harm: the evidence of each candidate, a prior about the start, and a lead
that is demanded.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration_core.config import SelectionConfig
from registration_core.geometry.kernels import Array32, squared_angle
from registration_core.judge import pixel_evidence as evidence
from registration_core.search.sparse_score import Prior, heavy_tails

Array = NDArray[np.float64]

LEAST_CLAIM = 0.3
"""Share of the mean silhouette: no smaller a claim is trusted in `match_shares`."""
LEAST_OUTLINE = 0.05
"""The same for the outline in `shown_shares`."""
PLANE_MATCH = 0.5
"""What a match on the supporting plane counts: the plane alone would match as well."""


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
    # not by BLAS, whose sums depend on the number of its threads
    evident = np.einsum("nc,c->n", counts, np.array(config.classes))
    return np.asarray(evident + config.match_share * match_shares(counts) - config.prior * tails)


def leads(candidates: Array32, counts: Array, config: SelectionConfig) -> Array:
    """What each of the poses (N, 3, 4), the start first, must score more than the one that stands, (N,).

    The more the start explains, by its counts (COUNT,), the more: one that claims nothing but what was not
    measured is given up for anything better. Much is demanded where it fits and the pose is another: the
    operator is probably right then, and a small correction does no harm.
    """
    explained = match_shares(counts[None])[0] / config.fit_match
    moved = np.linalg.norm(candidates[:, :, 3] - candidates[0, :, 3], axis=1)
    turned = np.array([squared_angle(T, candidates[0]) for T in candidates])
    aside = (moved > config.aside_translation) | (turned > config.aside_rotation**2)
    lead = config.lead * min(1.0, explained)
    return np.where(aside & (explained > 1.0), config.lead_over_fit, lead)


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


def match_shares(counts: Array) -> Array:
    """Share (N,) of the surface claimed and not hidden that was measured where it is claimed, off the plane
    or on it.
    """
    inside = _inside(counts)
    matched = inside[:, evidence.MATCHED] + PLANE_MATCH * inside[:, evidence.MATCHED_ON_PLANE]
    return matched / np.maximum(_claims(inside)[1], LEAST_CLAIM)


def shown_shares(counts: Array) -> Array:
    """Share (N,) of the outline's pixels that nothing in front hides."""
    outlines, shown = _claims(_inside(counts))
    return shown / np.maximum(outlines, LEAST_OUTLINE)


def _inside(counts: Array) -> Array:
    """Counts (N, INSIDE_BINS) of the inner part and the rim together."""
    bins = evidence.INSIDE_BINS
    return counts[:, :bins] + counts[:, bins : 2 * bins]


def _claims(inside: Array) -> tuple[Array, Array]:
    """Pixels within the outlines (N,), and those of them that are not hidden (N,)."""
    outlines = inside.sum(axis=1)
    return outlines, outlines - inside[:, list(evidence.HIDDEN)].sum(axis=1)
