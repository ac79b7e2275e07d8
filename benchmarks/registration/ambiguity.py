"""Whether depth could tell a wrong pose from the true one: a mug whose handle is hidden fits anyhow."""

import numpy as np
from numpy.typing import NDArray

from benchmarks.registration.instances import Instance
from registration_core.rendering.rasterizer import render_depth

DepthImage = NDArray[np.float32]

TOLERANCE = 0.005
"""Metres between depths that count as equal."""
SAME_FIT = 0.02
"""Share of the visible pixels by which one pose must contradict the image more than another."""


def fits_as_well(instance: Instance, T_camera_object: NDArray[np.float64]) -> bool:
    """Whether depth contradicts a pose (4, 4) hardly more than it does the true one.

    A pixel contradicts where the pose claims surface before the one that is seen, or does not explain one
    that belongs to the object. Perfect depth is asked where it is known, else what was measured.
    """
    seen = instance.depth
    if instance.perfect_depth is not None:
        seen = np.where(instance.perfect_depth > 0, instance.perfect_depth, np.float32(np.inf))
    truth = _drawn(instance, instance.truth)
    own = (seen > 0) & np.isfinite(truth) & np.isclose(truth, seen, rtol=0.0, atol=TOLERANCE)
    found = _contradictions(_drawn(instance, T_camera_object), seen, own)
    return found - _contradictions(truth, seen, own) <= SAME_FIT * int(own.sum())


def _contradictions(drawn: DepthImage, seen: DepthImage, own: NDArray[np.bool_]) -> int:
    before = (seen > 0) & (drawn < seen - TOLERANCE)
    unexplained = own & (drawn > seen + TOLERANCE)
    return int((before | unexplained).sum())


def _drawn(instance: Instance, T: NDArray[np.float64]) -> DepthImage:
    depth = render_depth(instance.model, instance.camera, T)
    return np.where(depth > 0, depth, np.float32(np.inf))
