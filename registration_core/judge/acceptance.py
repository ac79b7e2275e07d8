"""Which confidence is enough: from which on at most a given share of the accepted poses is wrong.

Selective classification with a guaranteed risk (Geifman and El-Yaniv, "Selective Classification for Deep
Neural Networks", NeurIPS 2017): the threshold is read off estimates of which it is known whether they were
right, and holds with a finite-sample bound, not only on average. Thresholds are tested from the strictest to
the loosest, several such sequences side by side (Angelopoulos et al., "Learn then Test", 2021).
"""

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import bdtr

Array = NDArray[np.float64]

FITTED = Path(__file__).parents[1] / "fitted.json"
"""The fitted numbers that come with the package, the calibration among them."""

NEVER = 2.0
"""A threshold that no confidence reaches."""
DELTA = 0.1
"""How often the bound may fail over repeated calibrations."""
STARTS = (0.25, 0.5, 0.75)
"""Further sequences begin where this share of the calibration would be accepted, so that one error at the
very top, which a confidence cannot see, does not end it all."""
ENOUGH_FOR_STARTS = 500
"""Estimates from which on they are tried: each sequence costs the others some of `DELTA`."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """Estimates of which it is known whether they were right; they have to be drawn as those to come are."""

    confidences: Array
    """(N,), in [0, 1]."""
    right: NDArray[np.bool_]
    """(N,), whether the MSSD was below 5 % of the diameter."""
    source: str
    """What they were made from, in words."""
    delta: float = DELTA
    """How often the bound may fail over repeated calibrations."""

    def __len__(self) -> int:
        return len(self.confidences)

    def accepted_share(self, threshold: float) -> float:
        """Share of the estimates whose confidence reaches a threshold; 0 where there are none."""
        return float(np.mean(self.confidences >= threshold)) if len(self) else 0.0


def calibration_of(
    confidences: ArrayLike, right: ArrayLike, source: str, delta: float = DELTA
) -> Calibration:
    """A checked calibration.

    Raises:
        ValueError: naming the argument that is wrong, and how.
    """
    values, flags = np.asarray(confidences, dtype=np.float64), np.asarray(right)
    if values.ndim != 1 or not ((values >= 0.0) & (values <= 1.0)).all():
        raise ValueError("confidences must be a list of numbers from 0 to 1")
    if flags.shape != values.shape or not np.isin(flags, (0, 1)).all():
        raise ValueError(f"right must be a list of {len(values)} booleans, one for each confidence")
    if not 0.0 < delta < 1.0:
        raise ValueError(f"delta must lie between 0 and 1; it is {delta!r}")
    return Calibration(values, flags.astype(np.bool_), source, float(delta))


@cache
def shipped_calibration(path: Path = FITTED) -> Calibration:
    """The calibration that comes with the package; one without any estimate where none does."""
    stored = json.loads(path.read_bytes()).get("calibration") if path.exists() else None
    if stored is None:
        return calibration_of([], [], "none")
    return calibration_of(stored["confidence"], stored["right"], stored["source"], stored["delta"])


def acceptance(risk: float, calibration: Calibration | None = None) -> float:
    """The least confidence to accept, so that at most the share `risk` of what is accepted is wrong.

    That holds with a probability of 1 - delta over calibrations that are drawn as the estimates to come are.

    Args:
        risk: above 0 and below 1.
        calibration: `shipped_calibration()` where it is None.

    Returns:
        A threshold in [0, 1], or `NEVER`, which is above 1, where the calibration bears none out.

    Raises:
        ValueError: where the risk is no such share.
    """
    if not 0.0 < risk < 1.0:
        raise ValueError(f"risk must lie between 0 and 1; it is {risk!r}")
    known = shipped_calibration() if calibration is None else calibration
    total = len(known)
    order = np.argsort(-known.confidences, kind="stable")
    values, wrong = known.confidences[order], np.cumsum(~known.right[order])
    # A count of accepted ones can be had only where the next confidence is lower.
    counts = np.flatnonzero(np.append(values[1:] < values[:-1], True)[:total]) + 1
    starts = STARTS if total >= ENOUGH_FOR_STARTS else ()
    level = known.delta / (1 + len(starts))
    # Given the next confidence, the accepted ones are independent draws from above it: their errors are
    # binomial, and an upper Clopper-Pearson bound is below the risk where this p-value is below the level.
    passed = bdtr(wrong[counts - 1], counts, risk) <= level
    strictest = fewest(risk, level)
    ends = [
        end
        for start in (strictest, *(share * total for share in starts))
        if (end := _end_of_sequence(passed, int(np.searchsorted(counts, start)))) >= 0
    ]
    if not ends:
        return NEVER
    accepted = counts[max(ends)]
    return float(np.nextafter(values[accepted], np.inf)) if accepted < total else 0.0


def fewest(risk: float, delta: float = DELTA) -> float:
    """Estimates below whose number no threshold can be borne out, even if all of them are right."""
    return float(np.log(delta) / np.log1p(-risk))


def _end_of_sequence(passed: NDArray[np.bool_], start: int) -> int:
    """Index of the last test of the sequence from `start` on that is passed with all before it; -1 where the
    first is not.
    """
    failed = np.flatnonzero(~passed[start:])
    end = start + (int(failed[0]) if len(failed) else len(passed) - start) - 1
    return end if end >= start else -1
