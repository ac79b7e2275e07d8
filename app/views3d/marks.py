"""Numbered marks in a 3-D view, drawn for one page alone: once that is loaded again, they are gone."""

from collections.abc import Sequence

import numpy as np
import viser
from numpy.typing import NDArray

MARK_COLOR = (255, 149, 64)
"""The human's, as in the pages' style sheet."""


def draw_marks(scene: viser.SceneApi, points: Sequence[NDArray[np.float64]], radius: float) -> None:
    """Number points (3,) from 1 on, in place of the marks before; `radius` in metres."""
    scene.remove_by_name("/marks")
    for number, point in enumerate(points, start=1):
        scene.add_icosphere(f"/marks/{number}", radius, MARK_COLOR, position=point)
        scene.add_label(f"/marks/{number}/number", str(number), anchor="bottom-left", font_screen_scale=1.2)
