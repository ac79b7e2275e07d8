"""What success and confidence are worth: intervals over scenes, ranking, calibration."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import rankdata

RESAMPLES, FEWER_RESAMPLES = 2000, 400
"""Of scenes; fewer for what is slow to compute."""
LEVEL = 0.95
ACCEPTED_GOOD = 0.9
"""Share of the right results that a threshold has to accept."""


@dataclass(frozen=True)
class Share:
    """A mean with the interval that holds it, by the bootstrap, with 95 % probability."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class ReliabilityBin:
    """Results of about the same confidence."""

    confidence: float
    """Mean of what was claimed."""
    correct: float
    """Share that is right."""
    count: int


def share_over_scenes(values: ArrayLike, scenes: Sequence[object], seed: int = 0) -> Share:
    """Mean of values (N,) with its percentile interval when whole scenes are drawn with replacement.

    What one scene makes hard is hard for all starts in it: they are no independent draws. (Efron and
    Tibshirani, "An Introduction to the Bootstrap", 1993, ch. 13; clusters as in Field and Welsh, JRSS B 2007)
    """
    numbers = np.asarray(values, dtype=np.float64)
    assert len(numbers) == len(scenes) > 0
    _, cluster = np.unique([str(scene) for scene in scenes], return_inverse=True)
    sums, counts = np.bincount(cluster, numbers), np.bincount(cluster)
    drawn = np.random.default_rng(seed).integers(len(sums), size=(RESAMPLES, len(sums)))
    means = sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1)
    low, high = np.quantile(means, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return Share(float(numbers.mean()), float(low), float(high))


def measure_over_scenes(
    measure: Callable[[NDArray[np.float64], NDArray[np.bool_]], float],
    confidence: ArrayLike,
    correct: ArrayLike,
    scenes: Sequence[object],
    seed: int = 0,
) -> Share:
    """A measure of confidences (N,) and what was right (N,), with its interval as for `share_over_scenes`.

    Draws of scenes without right or without wrong results, for which some measures are NaN, do not count.
    """
    claims, right = np.asarray(confidence, dtype=np.float64), np.asarray(correct, dtype=bool)
    assert len(claims) == len(right) == len(scenes) > 0
    _, cluster = np.unique([str(scene) for scene in scenes], return_inverse=True)
    members = [np.flatnonzero(cluster == k) for k in range(cluster.max() + 1)]
    rng, found = np.random.default_rng(seed), []
    for _ in range(FEWER_RESAMPLES):
        drawn = np.concatenate([members[k] for k in rng.integers(len(members), size=len(members))])
        found.append(measure(claims[drawn], right[drawn]))
    known = [value for value in found if not np.isnan(value)]
    low, high = np.quantile(known, [(1 - LEVEL) / 2, (1 + LEVEL) / 2]) if known else (np.nan, np.nan)
    return Share(float(measure(claims, right)), float(low), float(high))


def auroc(confidence: ArrayLike, correct: ArrayLike) -> float:
    """Probability that a right result is claimed with more confidence than a wrong one; a tie counts half.

    NaN where there are no right ones or no wrong ones. (Mann-Whitney U over the number of pairs)
    """
    scores, right = np.asarray(confidence, dtype=np.float64), np.asarray(correct, dtype=bool)
    good, bad = int(right.sum()), int((~right).sum())
    if good == 0 or bad == 0:
        return float("nan")
    u = rankdata(scores)[right].sum() - good * (good + 1) / 2
    return float(u / (good * bad))


def reliability(confidence: ArrayLike, correct: ArrayLike, bins: int = 10) -> list[ReliabilityBin]:
    """Bins of equal count, from the least confident results to the most.

    Results of equal confidence all count as right as they are on average: their order means nothing.
    """
    scores, right = np.asarray(confidence, dtype=np.float64), np.asarray(correct, dtype=np.float64)
    _, tie, size = np.unique(scores, return_inverse=True, return_counts=True)
    right = (np.bincount(tie, right) / size)[tie]
    order = np.argsort(scores, kind="stable")
    return [
        ReliabilityBin(float(scores[part].mean()), float(right[part].mean()), len(part))
        for part in np.array_split(order, bins)
        if len(part)
    ]


def calibration_error(confidence: ArrayLike, correct: ArrayLike, bins: int = 10) -> float:
    """Expected calibration error in [0, 1]: mean gap between confidence and share right, over the bins.

    With bins of equal count (Nguyen and O'Connor, EMNLP 2015).
    """
    parts = reliability(confidence, correct, bins)
    total = sum(part.count for part in parts)
    return sum(part.count * abs(part.confidence - part.correct) for part in parts) / total


def false_accepts(confidence: ArrayLike, correct: ArrayLike, accepted_good: float = ACCEPTED_GOOD) -> float:
    """Share of the wrong results that are accepted with the highest threshold that accepts enough good ones.

    NaN where there are no right ones or no wrong ones.
    """
    scores, right = np.asarray(confidence, dtype=np.float64), np.asarray(correct, dtype=bool)
    if right.all() or not right.any():
        return float("nan")
    good = np.sort(scores[right])[::-1]
    threshold = good[int(np.ceil(accepted_good * len(good))) - 1]
    return float((scores[~right] >= threshold).mean())


def percentiles(values: ArrayLike) -> tuple[float, float]:
    """Median and 95th percentile of values (N,)."""
    median, p95 = np.percentile(np.asarray(values, dtype=np.float64), [50, 95])
    return float(median), float(p95)
