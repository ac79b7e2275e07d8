"""Whether depth could tell a wrong pose from the true one: a mug whose handle is hidden fits anyhow."""

import numpy as np
from numpy.typing import NDArray

from benchmarks.registration.instances import Instance
from registration_core.rasterizer import render_depth

TOLERANCE = 0.004
"""Metres between depths that count as equal."""
SAME_FIT = 0.02
"""Share of the visible pixels by which one pose must contradict the image more than another."""


def fits_as_well(instance: Instance, T_camera_object: NDArray[np.float64]) -> bool:
    """Whether perfect depth contradicts a pose (4, 4) no more than it does the true one.

    False where perfect depth is not known. A pixel contradicts where the pose claims surface before the one
    that is seen, or does not explain one that belongs to the object.
    """
    if instance.perfect_depth is None:
        return False
    seen = np.where(instance.perfect_depth > 0, instance.perfect_depth, np.inf)
    truth = _drawn(instance, instance.truth)
    own = np.isfinite(truth) & (truth <= seen + 1e-4)
    drawn = _drawn(instance, T_camera_object)
    before = drawn < seen - TOLERANCE
    unexplained = own & (drawn > seen + TOLERANCE)
    return int((before | unexplained).sum()) <= SAME_FIT * int(own.sum())


def _drawn(instance: Instance, T: NDArray[np.float64]) -> NDArray[np.float32]:
    depth = render_depth(instance.model, instance.camera, T)
    return np.where(depth > 0, depth, np.float32(np.inf))
