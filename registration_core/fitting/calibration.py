"""How likely a winner is right, and from which confidence on another round is not worth its time."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import expit

from registration_core.judge.confidence import FEATURES

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

RIDGE = 0.003
"""Penalty on the squared weights of features scaled to unit variance, per decision; the intercept is free."""
FREE = ("intercept", "color")
"""Features that say nothing of a pose by themselves."""
LOST = 0.002
"""Share of all snaps that may end wrong because a further round was left out."""


def logistic_weights(features: Array, right: Flags, ridge: float = RIDGE) -> Array:
    """Weights (F,) of FEATURES (N, F) by which the flags (N,) are most probable; nothing that speaks for a
    pose may speak against it but what is in FREE.
    """
    scale = features.std(axis=0)
    scale[0] = 1.0
    scale = np.maximum(scale, 1e-6)
    scaled, target = features / scale, right.astype(np.float64)

    def loss(weights: Array) -> tuple[float, Array]:
        logits = scaled @ weights
        penalised = np.concatenate([[0.0], weights[1:]])
        value = np.mean(np.logaddexp(0.0, logits) - target * logits) + ridge / 2.0 * penalised @ penalised
        return float(value), scaled.T @ (expit(logits) - target) / len(target) + ridge * penalised

    bounds = [(None if name in FREE else 0.0, None) for name in FEATURES]
    found = minimize(loss, np.zeros(len(scale)), jac=True, method="L-BFGS-B", bounds=bounds)
    return found.x / scale


def log_loss(probabilities: Array, right: Flags) -> float:
    """Mean negative log-likelihood of flags (N,) under probabilities (N,)."""
    p = np.clip(probabilities, 1e-6, 1.0 - 1e-6)
    return float(-np.mean(np.where(right, np.log(p), np.log(1.0 - p))))


def auroc(probabilities: Array, right: Flags) -> float:
    """How often a right one has a higher probability than a wrong one; ties count half."""
    good, bad = probabilities[right], probabilities[~right]
    if not len(good) or not len(bad):
        return float("nan")
    order = np.sort(bad)
    below, upto = np.searchsorted(order, good, "left"), np.searchsorted(order, good, "right")
    return float(np.mean((below + upto) / 2.0) / len(bad))


def calibration_error(probabilities: Array, right: Flags, bins: int = 10) -> float:
    """Mean distance between what is claimed and what is true, over bins of equally many."""
    parts = np.array_split(np.argsort(probabilities, kind="stable"), bins)
    gaps = [len(part) * abs(probabilities[part].mean() - right[part].mean()) for part in parts if len(part)]
    return float(np.sum(gaps) / len(probabilities))


def doubt(confidence: Array, right_now: Flags, right_after: Flags, lost: float = LOST) -> float:
    """The confidence (N,) from which on another round is left out: the lowest one above which so few snaps
    would have ended right only by that round, counted less those that it spoils.
    """
    order = np.argsort(-confidence, kind="stable")
    gained = np.cumsum(right_after[order].astype(int) - right_now[order].astype(int)) / len(order)
    too_much = np.flatnonzero(gained > lost)
    if not len(too_much):
        return 0.0
    return float(round(confidence[order][too_much[0]], 3))


def weights_by_name(names: Sequence[str], weights: Array) -> dict[str, float]:
    """Weights as they are written down."""
    return {name: float(f"{weight:.4g}") for name, weight in zip(names, weights, strict=True)}
