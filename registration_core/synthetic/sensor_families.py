"""Kinds of depth sensors, each with the ranges from which the errors of one image are drawn.

    sensor = draw_sensor(FAMILIES["active stereo"], rng)
    depth = measure(perfect_depth, camera, rng, sensor)

The ranges bracket what real images of such sensors show at the true poses of known objects ("Sensors" in
docs/registration.md).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from registration_core.synthetic.sensors import Sensor, measure

__all__ = ["DEMO", "FAMILIES", "Sensor", "SensorFamily", "draw_sensor", "measure"]

Range = tuple[float, float]
"""Least and largest value."""


@dataclass(frozen=True)
class SensorFamily:
    """Sensors of one kind."""

    name: str
    ranges: Mapping[str, Range]
    """By field of `Sensor`, the same for both numbers of a pair; other fields keep their defaults."""


def draw_sensor(family: SensorFamily, rng: np.random.Generator) -> Sensor:
    """The errors of one image, uniform within each range; nothing is drawn for a range of a single value."""
    return Sensor(
        **{name: _drawn(getattr(Sensor, name), *family.ranges[name], rng) for name in family.ranges}
    )


def _drawn(default: Any, low: float, high: float, rng: np.random.Generator) -> Any:
    """A number, or a pair of numbers, between two, of the default's type."""
    if isinstance(default, tuple):
        return tuple(_drawn(item, low, high, rng) for item in default)
    value = low if low == high else float(rng.uniform(low, high))
    return round(value) if isinstance(default, int) else value


DEMO = SensorFamily(
    "demo",
    {
        "jitter": (0.5, 0.5),
        "noise": (0.001, 0.001),
        "waves": (0.0007, 0.0007),
        "step": (0.001, 0.001),
        "edge_holes": (0.7, 0.7),
        "grazing": (0.2, 0.2),
        "speckle_holes": (0.01, 0.01),
        "blobs": (6, 6),
    },
)
"""The sensor of the demo scenes: structured light at its best, always the same."""

STRUCTURED_LIGHT = SensorFamily(
    "structured light",
    {
        "shift": (-1.2, 1.2),
        "warp": (0.3, 1.5),
        "warp_radius": (2.0, 5.0),
        "growth": (0.0, 4.0),
        "blend": (0.4, 1.5),
        "blend_gap": (0.01, 0.03),
        "flying": (0.0, 0.15),
        "noise": (0.0002, 0.0012),
        "waves": (0.0003, 0.0035),
        "wave_radius": (2.0, 6.0),
        "bias": (-0.004, 0.004),
        "step": (0.001, 0.0014),
        "unit": (0.001, 0.001),
        "edge_holes": (0.0, 0.5),
        "rim_holes": (0.0, 2.5),
        "baseline": (0.075, 0.075),
        "grazing": (0.1, 0.5),
        "patches": (0.0, 0.03),
        "patch_radius": (3.0, 8.0),
        "speckle_holes": (0.0, 0.02),
        "blobs": (7, 7),
        "color_shift": (-3.0, 3.0),
    },
)
"""PrimeSense, Asus Xtion: wavy rims, shadows to one side, holes where light grazes."""

COARSE_STRUCTURED_LIGHT = SensorFamily(
    "coarse structured light",
    {
        "shift": (-2.0, 2.0),
        "warp": (0.5, 2.0),
        "warp_radius": (2.0, 6.0),
        "growth": (0.0, 3.0),
        "blend": (0.4, 2.0),
        "blend_gap": (0.01, 0.03),
        "flying": (0.0, 0.15),
        "noise": (0.0008, 0.0015),
        "waves": (0.0005, 0.0035),
        "wave_radius": (2.0, 6.0),
        "bias": (-0.005, 0.005),
        "step": (0.0025, 0.003),
        "unit": (0.001, 0.001),
        "edge_holes": (0.0, 0.3),
        "rim_holes": (0.0, 1.0),
        "baseline": (0.02, 0.075),
        "grazing": (0.02, 0.3),
        "patches": (0.0, 0.03),
        "patch_radius": (3.0, 8.0),
        "speckle_holes": (0.0, 0.005),
        "blobs": (7, 7),
        "color_shift": (-4.0, 4.0),
    },
)
"""Kinect v1: disparity in coarse steps, few holes at rims, colour further off."""

LINE_PATTERN = SensorFamily(
    "line pattern",
    {
        "shift": (-1.0, 1.0),
        "warp": (0.2, 1.0),
        "warp_radius": (3.0, 8.0),
        "growth": (0.0, 2.0),
        "blend": (1.0, 3.0),
        "blend_gap": (0.02, 0.06),
        "noise": (0.0005, 0.002),
        "waves": (0.002, 0.014),
        "wave_radius": (5.0, 10.0),
        "bias": (-0.01, 0.01),
        "step": (0.0001, 0.001),
        "unit": (0.0001, 0.0001),
        "edge_holes": (0.0, 0.9),
        "rim_holes": (0.0, 4.0),
        "baseline": (-0.06, 0.06),
        "grazing": (0.2, 0.7),
        "patches": (0.0, 0.08),
        "patch_radius": (4.0, 12.0),
        "speckle_holes": (0.0, 0.02),
        "blobs": (7, 7),
        "lines": (3.0, 6.0),
        "farthest": (1.2, 2.0),
        "color_shift": (-3.0, 3.0),
    },
)
"""RealSense F200, SR300: short range, up to half of the pixels without depth between lines of the pattern."""

ACTIVE_STEREO = SensorFamily(
    "active stereo",
    {
        "shift": (-1.5, 1.5),
        "warp": (0.8, 2.5),
        "warp_radius": (3.0, 8.0),
        "growth": (0.0, 4.0),
        "blend": (1.5, 8.0),
        "blend_gap": (0.03, 0.2),
        "flying": (0.0, 0.15),
        "noise": (0.0002, 0.001),
        "waves": (0.003, 0.009),
        "wave_radius": (4.0, 10.0),
        "bias": (-0.006, 0.006),
        "step": (0.0005, 0.0018),
        "unit": (0.001, 0.001),
        "edge_holes": (0.0, 0.2),
        "rim_holes": (0.0, 0.8),
        "baseline": (-0.055, 0.055),
        "grazing": (0.0, 0.06),
        "patches": (0.0, 0.03),
        "patch_radius": (3.0, 10.0),
        "speckle_holes": (0.0, 0.003),
        "blobs": (7, 7),
        "color_shift": (-4.0, 4.0),
    },
)
"""RealSense D400: broad waves, windows that melt small steps and blur rims, few holes."""

TIME_OF_FLIGHT = SensorFamily(
    "time of flight",
    {
        "shift": (-0.7, 0.7),
        "jitter": (0.0, 0.3),
        "blend": (0.4, 1.2),
        "blend_gap": (0.02, 0.05),
        "rounding": (0.1, 0.6),
        "rounding_radius": (6.0, 14.0),
        "flying": (0.3, 0.9),
        "noise": (0.001, 0.003),
        "waves": (0.0003, 0.0015),
        "wave_radius": (3.0, 10.0),
        "offset": (-0.006, 0.006),
        "unit": (0.001, 0.001),
        "edge_holes": (0.0, 0.5),
        "rim_holes": (0.0, 1.5),
        "grazing": (0.05, 0.3),
        "patches": (0.0, 0.05),
        "patch_radius": (3.0, 10.0),
        "speckle_holes": (0.0, 0.005),
        "color_shift": (-3.0, 3.0),
    },
)
"""Kinect v2, Azure Kinect: flying pixels at rims, concave corners rounded, the whole image off."""

INDUSTRIAL = SensorFamily(
    "industrial",
    {
        "shift": (-0.3, 0.3),
        "jitter": (0.0, 0.3),
        "blend": (0.0, 0.8),
        "blend_gap": (0.003, 0.01),
        "noise": (0.00005, 0.0003),
        "waves": (0.00005, 0.0004),
        "wave_radius": (2.0, 8.0),
        "bias": (-0.001, 0.001),
        "edge_holes": (0.3, 1.0),
        "rim_holes": (0.0, 2.0),
        "baseline": (0.03, 0.15),
        "grazing": (0.1, 0.5),
        "patches": (0.0, 0.1),
        "patch_radius": (3.0, 10.0),
        "speckle_holes": (0.0, 0.01),
        "blobs": (6, 6),
        "color_shift": (-0.5, 0.5),
    },
)
"""Projected patterns at high resolution: low noise, long shadows, holes on shiny parts."""

FAMILIES: Mapping[str, SensorFamily] = {
    family.name: family
    for family in (
        DEMO,
        STRUCTURED_LIGHT,
        COARSE_STRUCTURED_LIGHT,
        LINE_PATTERN,
        ACTIVE_STEREO,
        TIME_OF_FLIGHT,
        INDUSTRIAL,
    )
}
