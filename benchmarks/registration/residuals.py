"""What depth is off by at a known pose: its spread, how far neighbours share it, and what happens at rims."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

DepthImage = NDArray[np.float32]
Mask = NDArray[np.bool_]
Array = NDArray[np.float64]

INSIDE = 4.0
"""Pixels from the outline from which on a pixel is not at the rim."""
RIM = 6
"""Pixels to both sides of the outline that the profile tells of."""
STEP_BACK = 0.02
"""Metres by which what lies beyond the outline is further away, for the outline to count as a rim."""
CLAIM = 0.01
"""Metres from the rim's depth up to which depth beyond the outline is taken for the object's."""
HIDDEN = 0.03
"""Depth nearer than the object by more than this belongs to something that hides it, metres."""
BANDS = (0.003, 0.006, 0.012)
"""Metres off that bound the classes of pixels."""
LONGEST = 40
"""Pixels up to which correlation is followed."""
LEAST = 300
"""Pixels inside that statistics need."""
NORMAL = 1.4826
"""Median absolute deviation times this is the standard deviation of a normal distribution."""


@dataclass(frozen=True, eq=False)
class Residuals:
    """Of one object in one image; metres, and shares in [0, 1]. Positive residuals are too far away."""

    distance: float
    """Median depth of the object."""
    bias: float
    """Median residual inside."""
    spread: float
    """Median absolute deviation from it, scaled to a standard deviation."""
    p95: float
    """95th percentile of the absolute deviation from it."""
    length: float
    """Pixels at which the correlation of residuals inside has fallen to 1/e."""
    off: tuple[float, float, float]
    """Shares of measured pixels, inside and at rims, that are off by as much as the classes of BANDS say."""
    missing_inside: float
    missing_rim: float
    """Shares of the pixels without depth, from INSIDE on and before."""
    step: float
    """Median difference between neighbouring values inside, scaled to 1 m; NaN of a single value."""
    rim: Array
    """(RIM, 4): at 0, 1, ... pixels inside of a rim the median deviation, its spread, the share further away
    by more than the last of BANDS, and the share missing."""
    beyond: Array
    """(RIM, 2): at 1, 2, ... pixels beyond a rim the share that claims the object's depth, and the share
    missing."""


def residuals(depth: DepthImage, perfect: DepthImage, owner: NDArray[np.int32], own: int) -> Residuals | None:
    """Compare measured with perfect depth (H, W) where `owner` (H, W) is `own`; None where too little is."""
    mask = owner == own
    rows, columns = np.nonzero(mask)
    if len(rows) < LEAST:
        return None
    window = (_around(rows, mask.shape[0]), _around(columns, mask.shape[1]))
    depth, perfect, mask = depth[window], perfect[window], mask[window]
    off = (depth - perfect).astype(np.float64)
    mask &= (depth == 0.0) | (off > -HIDDEN)
    from_outline, (row, column) = distance_transform_edt(mask, return_indices=True)
    inside = mask & (from_outline > INSIDE)
    measured = depth > 0.0
    used = inside & measured & (np.abs(off) < HIDDEN)
    if np.count_nonzero(used) < LEAST:
        return None
    bias = float(np.median(off[used]))
    deviation = np.abs(off[used] - bias)
    seen = np.abs(off[mask & measured])
    classes = [float(np.mean((low < seen) & (seen <= high))) for low, high in _between(BANDS)]
    z = float(np.median(perfect[mask]))
    values = np.unique(depth[used])
    is_rim = mask & (perfect[row, column] > perfect + STEP_BACK)
    return Residuals(
        z, bias, NORMAL * float(np.median(deviation)), float(np.percentile(deviation, 95.0)),
        correlation_length(off - bias, used), (classes[0], classes[1], classes[2]),
        1.0 - float(measured[inside].mean()), 1.0 - float(measured[mask & ~inside].mean()),
        float(np.median(np.diff(values))) / z**2 if len(values) > 1 else np.nan,
        _rim_profile(off - bias, measured, from_outline, is_rim), _profile_beyond(depth, perfect, mask),
    )  # fmt: skip


def _around(indices: NDArray[np.int64], size: int) -> slice:
    """Where indices lie, with room for the profile."""
    return slice(max(0, int(indices.min()) - RIM - 2), min(size, int(indices.max()) + RIM + 3))


def _between(bounds: tuple[float, ...]) -> list[tuple[float, float]]:
    return list(zip(bounds, (*bounds[1:], np.inf), strict=True))


def correlation_length(values: Array, used: Mask) -> float:
    """Pixels, along rows and columns, at which the correlation of values (H, W) has fallen to 1/e.

    Only pairs count both of whose pixels are in `used` (H, W); LONGEST where it never falls as low.
    """
    chosen = np.where(used, values - values[used].mean(), 0.0)
    variance = float((chosen**2).sum() / used.sum())
    last = 1.0
    for distance in range(1, LONGEST):
        total = count = 0.0
        for a, b, pairs in (
            (chosen[:, :-distance], chosen[:, distance:], used[:, :-distance] & used[:, distance:]),
            (chosen[:-distance], chosen[distance:], used[:-distance] & used[distance:]),
        ):
            total += float((a * b).sum())
            count += float(pairs.sum())
        if count == 0.0 or variance == 0.0:
            return float(distance)
        here = total / count / variance
        if here < np.exp(-1.0):
            return distance - 1.0 + (last - np.exp(-1.0)) / (last - here)
        last = here
    return float(LONGEST)


def _rim_profile(deviation: Array, measured: Mask, from_outline: Array, is_rim: Mask) -> Array:
    """`Residuals.rim`; NaN where there is no rim."""
    profile = np.full((RIM, 4), np.nan)
    for k in range(RIM):
        ring = is_rim & (k < from_outline) & (from_outline <= k + 1)
        there = deviation[ring & measured]
        if len(there):
            middle = np.median(there)
            spread = NORMAL * np.median(np.abs(there - middle))
            profile[k] = middle, spread, np.mean(there > BANDS[-1]), 1.0 - len(there) / ring.sum()
    return profile


def _profile_beyond(depth: DepthImage, perfect: DepthImage, mask: Mask) -> Array:
    """`Residuals.beyond`; NaN where there is no rim."""
    profile = np.full((RIM, 2), np.nan)
    distance, (row, column) = distance_transform_edt(~mask, return_indices=True)
    rim_depth = perfect[row, column]
    behind = ~mask & (perfect > rim_depth + STEP_BACK)
    for k in range(RIM):
        ring = behind & (k < distance) & (distance <= k + 1)
        if ring.any():
            there, measured = np.abs(depth - rim_depth)[ring], depth[ring] > 0.0
            profile[k] = np.mean(measured & (there < CLAIM)), 1.0 - measured.mean()
    return profile
