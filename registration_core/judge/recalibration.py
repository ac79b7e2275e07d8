"""A monotone correction of the confidence, fitted to results of which it is known whether they were right.

Platt's scaling: the log-odds are stretched and shifted. Few results move it little, since both numbers are
drawn towards changing nothing; the order of confidences, and with it what `acceptance` can tell, stays.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize
from scipy.special import expit, logit

Array = NDArray[np.float64]

CERTAIN = 1e-4
"""No confidence counts as nearer to 0 or 1 than this."""
SPREAD_OF_STRETCH, SPREAD_OF_SHIFT = 0.5, 1.0
"""Standard deviations of what is believed beforehand of the logarithm of the stretch, and of the shift."""


@dataclass(frozen=True)
class Recalibration:
    """A stretch, which is positive, and a shift of the log-odds."""

    stretch: float = 1.0
    shift: float = 0.0

    def __call__(self, confidences: ArrayLike) -> Array:
        """Corrected confidences, of the same shape."""
        return _moved(np.asarray(confidences, dtype=np.float64), self.stretch, self.shift)


def recalibration(confidences: Array, right: NDArray[np.bool_], weights: Array) -> Recalibration:
    """The most likely correction, of confidences, whether they were right, and how much each counts, (N,)."""

    def loss(parameters: Array) -> float:
        log_stretch, shift = parameters
        chance = _moved(confidences, float(np.exp(log_stretch)), shift)
        likelihood = weights @ np.log(np.where(right, chance, 1.0 - chance))
        prior = (log_stretch / SPREAD_OF_STRETCH) ** 2 + (shift / SPREAD_OF_SHIFT) ** 2
        return float(0.5 * prior - likelihood)

    log_stretch, shift = minimize(loss, np.zeros(2), method="Nelder-Mead").x
    return Recalibration(float(np.exp(log_stretch)), float(shift))


def _moved(confidences: Array, stretch: float, shift: float) -> Array:
    known = np.clip(confidences, CERTAIN, 1.0 - CERTAIN)
    return np.clip(expit(stretch * logit(known) + shift), 1e-9, 1.0 - 1e-9)
