"""Meshes that are a little wrong, as scans and drawings of real objects are."""

from dataclasses import replace

import numpy as np

from registration_core.geometry.object_model import ObjectModel

WAVES = 3
"""Of the warp, each with a direction and a length of its own."""
WAVE_LENGTHS = (0.7, 2.0)
"""Of one wave, in diameters: nothing that bends sharply."""


def imprecise(
    model: ObjectModel, rng: np.random.Generator, scale: float = 0.01, warp: float = 0.005
) -> ObjectModel:
    """The model with its size off by up to `scale` along each axis of its frame, and warped smoothly by up to
    `warp` of its diameter.

    Some meshes are better than others: how much either may be is drawn first. Both leave the centre about
    where it is. The symmetries stay those of the true object.
    """
    factors = 1.0 + scale * rng.random() * rng.uniform(-1.0, 1.0, 3)
    away = model.vertices - model.centre
    moved = np.zeros_like(away)
    for _ in range(WAVES):
        direction, push = (v / np.linalg.norm(v) for v in rng.normal(0.0, 1.0, (2, 3)))
        length = model.diameter * rng.uniform(*WAVE_LENGTHS)
        moved += np.sin(away @ direction * 2.0 * np.pi / length)[:, None] * push
    largest = rng.uniform(0.0, warp) * model.diameter / WAVES
    return replace(model, vertices=model.centre + factors * away + largest * moved)
