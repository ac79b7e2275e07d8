"""The fitted numbers that follow from a feature table, and how they do on what they were not fitted to."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from registration_core.config import ALWAYS
from registration_core.fitting import calibration
from registration_core.fitting.ranking import Choice, Flags, best_ridge, fitted_weights, needless, where
from registration_core.fitting.replay import TEMPERATURES
from registration_core.fitting.table import FeatureTable, from_units
from registration_core.judge import pixel_evidence as evidence
from registration_core.judge.confidence import FEATURES, features

Array = NDArray[np.float64]

FOLDS = 5
"""Of the kinds of objects, in cross-validation; families are left out one by one."""
DELTA = 0.1
"""How often the bound on accepted wrong poses may fail over repeated calibrations."""


def judge_choices(table: FeatureTable) -> dict[str, Any]:
    """The penalty of the judge's weights that predicts kinds and families best which are left out, and the
    names of the classes that do not help to.
    """
    choices, kinds = table.choices(), kind_folds(table)
    ridge = best_ridge(choices, [*kinds, *family_folds(table)])
    removed = needless(choices, kinds, ridge)
    return {"ridge": ridge, "removed": [evidence.class_names()[k] for k in removed]}


def judge_numbers(table: FeatureTable, ridge: float, removed: list[str]) -> dict[str, Any]:
    """Weights of the judgement with a penalty, and without the classes of these names."""
    *classes, match_share, prior = fitted_weights(table.choices(), ridge, class_indices(removed))
    return {
        "classes": calibration.weights_by_name(evidence.class_names(), np.array(classes)),
        "match_share": _short(match_share),
        "prior": _short(prior),
    }


def class_indices(names: list[str]) -> list[int]:
    """Where the classes of these names are."""
    return [evidence.class_names().index(name) for name in names]


def confidence_numbers(table: FeatureTable) -> dict[str, Any]:
    """The temperature and weights of the confidence."""
    rounds = range(ALWAYS, table.scores.shape[1])
    losses = []
    for k in range(len(TEMPERATURES)):
        spoken = np.concatenate([decision_features(table, r, k) for r in rounds])
        right = np.concatenate([table.won_exact[:, r] for r in rounds])
        weights = calibration.logistic_weights(spoken, right)
        losses.append((calibration.log_loss(expit(spoken @ weights), right), k, weights))
    _, best, weights = min(losses, key=lambda tried: tried[0])
    return {"temperature": TEMPERATURES[best], "weights": calibration.weights_by_name(FEATURES, weights)}


def doubt_numbers(table: FeatureTable, confidence: dict[str, Any]) -> list[float]:
    """For each round the confidence from which on it is left out."""
    claims, right = claimed(table, confidence), table.won_right
    optional = range(ALWAYS, right.shape[1] - 1)
    fitted = [calibration.doubt(claims[:, r], right[:, r], right[:, r + 1]) for r in optional]
    return [1.0] * ALWAYS + fitted


def calibration_numbers(
    table: FeatureTable, confidence: dict[str, Any], doubts: list[float]
) -> dict[str, Any]:
    """Confidences of whole snaps, by weights fitted without the sensor's family, and which were right."""
    claims, right = held_out_claims(table, confidence, doubts)
    return {
        "confidence": [_short(claim) for claim in claims],
        "right": right.astype(int).tolist(),
        "source": "synthetic scenes, each sensor family left out of the fit of its confidence",
        "delta": DELTA,
    }


def scores(
    table: FeatureTable,
    ridge: float,
    removed: list[str],
    confidence: dict[str, Any],
    doubts: list[float],
) -> dict[str, Any]:
    """How well the numbers do on kinds and families left out of the fit, beside all fitted to all."""
    choices, without = table.choices(), class_indices(removed)
    every = np.ones(len(choices), np.bool_)
    fitted = _winners(choices, every, fitted_weights(choices, ridge, without))
    by_kind = _left_out(choices, kind_folds(table), ridge, without)
    by_family = _left_out(choices, family_folds(table), ridge, without)
    families = sorted(set(table.families.tolist()))
    claims, right = held_out_claims(table, confidence, doubts)
    ended = last_rounds(claimed(table, confidence), doubts)
    chosen = table.won_right[np.arange(len(ended)), ended]
    return {
        **{
            f"{measure}_{name}": _short(float(found[:, k].mean()))
            for k, measure in enumerate(("right", "exact"))
            for name, found in (
                ("fitted_to_all", fitted),
                ("kinds_left_out", by_kind),
                ("families_left_out", by_family),
            )
        },
        "right_by_family_left_out": {
            family: _short(float(by_family[table.families == family, 0].mean())) for family in families
        },
        "snaps_right": _short(float(chosen.mean())),
        "auroc_families_left_out": _short(calibration.auroc(claims, right)),
        "calibration_error_families_left_out": _short(calibration.calibration_error(claims, right)),
        "rounds_a_snap": _short(float(ended.mean())),
    }


def decision_features(table: FeatureTable, rounds: int, temperature: int) -> Array:
    """FEATURES (T, F) of the winners after so many rounds."""
    beliefs = table.beliefs[:, rounds, temperature].astype(np.float64)
    values, counts = table.scores[:, rounds].astype(np.float64), from_units(table.counts[:, rounds])
    return features(beliefs, values, counts, table.spreads[:, rounds].astype(np.float64))


def claimed(table: FeatureTable, confidence: dict[str, Any]) -> Array:
    """The confidence (T, R) after the polish and after each round."""
    weights, k = np.array(list(confidence["weights"].values())), TEMPERATURES.index(confidence["temperature"])
    spoken = [decision_features(table, r, k) for r in range(table.scores.shape[1])]
    return np.stack([expit(one @ weights) for one in spoken], axis=1)


def last_rounds(claims: Array, doubts: list[float]) -> NDArray[np.intp]:
    """After how many rounds snaps of these confidences (T, R) end, (T,): rounds that the confidence so
    far makes needless are left out.
    """
    at = np.zeros(len(claims), dtype=np.intp)
    for r, limit in enumerate(doubts):
        goes_on = claims[np.arange(len(claims)), at] <= limit
        at[goes_on] = r + 1
    return at


def held_out_claims(
    table: FeatureTable, confidence: dict[str, Any], doubts: list[float]
) -> tuple[Array, NDArray[np.bool_]]:
    """Confidences (T,) of whole snaps by weights fitted without their family, and whether they were right."""
    ended = last_rounds(claimed(table, confidence), doubts)
    k = TEMPERATURES.index(confidence["temperature"])
    every = np.stack([decision_features(table, r, k) for r in range(table.scores.shape[1])], axis=1)
    spoken, right = every[np.arange(len(ended)), ended], table.won_exact[np.arange(len(ended)), ended]
    claims = np.zeros(len(ended))
    for family in sorted(set(table.families)):
        out = table.families == family
        rest = every[~out, ALWAYS:].reshape(-1, every.shape[2])
        weights = calibration.logistic_weights(rest, table.won_exact[~out, ALWAYS:].ravel())
        claims[out] = expit(spoken[out] @ weights)
    return claims, right


def kind_folds(table: FeatureTable) -> list[NDArray[np.bool_]]:
    """Masks (T,) of trials to leave out together, by their kind of object."""
    names = sorted(set(table.kinds.tolist()))
    return [np.isin(table.kinds, names[fold::FOLDS]) for fold in range(FOLDS)]


def family_folds(table: FeatureTable) -> list[NDArray[np.bool_]]:
    """The same, one sensor family at a time."""
    return [table.families == name for name in sorted(set(table.families.tolist()))]


def _left_out(
    choices: list[Choice], folds: list[Flags], ridge: float, removed: list[int]
) -> NDArray[np.bool_]:
    """Whether the best candidate of each trial is right, and exact, (T, 2), fitted without its fold."""
    found = np.zeros((len(choices), 2), np.bool_)
    for out in folds:
        weights = fitted_weights(where(choices, ~out), ridge, removed)
        found[out] = _winners(choices, out, weights)
    return found


def _winners(choices: list[Choice], of: Flags, weights: Array) -> NDArray[np.bool_]:
    """Whether the best candidate is right, and exact, (N, 2), in each trial that a mask (T,) keeps."""
    kept = [(one, np.argmax(one.features @ weights)) for one in where(choices, of)]
    return np.array([(one.right[best], one.exact[best]) for one, best in kept])


def _short(value: float) -> float:
    return float(f"{value:.4g}")
