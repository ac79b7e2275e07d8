# mypy: allow-untyped-defs
"""Two certificates beside the confidence, which speak of this one image and not of many like it.

A result is *observably correct* where depth that the snap did not read agrees with it: the pixels that are
held out where the image is reduced, and views that were not used. It is *not degenerate* where no other pose,
symmetric twins aside, explains the depth as well. After Talak, Peng and Carlone, "Certifiable Object Pose
Estimation" (2023).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from registration_core.geometry import pose
from registration_core.geometry.camera import Intrinsics
from registration_core.geometry.kernels import EXACT
from registration_core.rendering.depth_verdicts import HIDDEN, TOLERANCE
from registration_core.rendering.rasterizer import draw_mesh
from registration_core.search.observation import FARTHEST, is_held_out
from registration_core.search.viewpoint_model import ViewpointModel

Array = NDArray[np.float64]

LEAST_SEEN = 0.3
"""Share of the pixels that must be measured and not hidden: less of the object proves nothing."""
LEAST_MATCH = 0.85
"""Share of those that must match."""
MOST_OFF = 0.05
"""Share of those that may lie clearly behind the object, and as many clearly before it."""
CLEAR = 2.4
"""Tolerances of a match from which on a pixel lies clearly elsewhere: 12 mm up to a distance of 1 m."""


@dataclass(frozen=True)
class Check:
    """What depth that a snap did not read says of its result."""

    pixels: int
    """Within the object's outline; 0 where there are none, and then nothing is said."""
    seen: float
    """Share of them that was measured and is not hidden."""
    match: float
    """Share of the seen ones that match; as are the two below."""
    behind: float
    """Depth lies clearly behind the object: the sensor saw through it."""
    behind_by: float
    """Metres, the median of those."""
    before: float
    """Depth lies clearly before the object, which cannot be inside of something."""
    before_by: float
    """Metres, the median of those."""

    @property
    def is_enough(self) -> bool:
        """Whether enough of the object is seen for the rest to mean something."""
        return self.pixels > 0 and self.seen >= LEAST_SEEN

    @property
    def agrees(self) -> bool:
        """Whether the result may be right as far as this can tell."""
        off = max(self.behind, self.before)
        return self.is_enough and self.match >= LEAST_MATCH and off <= MOST_OFF


NOTHING = Check(0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""No pixel was left to check a result by."""


@dataclass(frozen=True)
class Certificates:
    """What can be said of a result beside how sure it is."""

    observably_correct: bool
    """Depth that the snap did not read agrees with it, in at least one view, and in none it disagrees."""
    non_degenerate: bool
    """No other pose explains the depth as well, symmetric twins aside."""
    check: Check
    """The one that decided: of a view that disagrees, else of one that agrees, else of the first."""
    unused: tuple[Check, ...]
    """What each view says that was not used, in their order."""

    @property
    def views(self) -> int:
        """Unused views that show enough of the object to tell."""
        return sum(check.is_enough for check in self.unused)


def certified(
    converged: bool, is_ambiguous: bool, own: Sequence[Check], unused: Sequence[Check] = ()
) -> Certificates:
    """The certificates of a result.

    Args:
        converged, is_ambiguous: as its estimate says.
        own: at least one, of the pixels held out in the views that it was made from, or `NOTHING`.
        unused: of whole views that it was not made from.
    """
    telling = [check for check in (*own, *unused) if check.is_enough]
    agreeing = telling[0] if telling else own[0]
    decisive = next((check for check in telling if not check.agrees), agreeing)
    return Certificates(
        observably_correct=converged and decisive.agrees,
        non_degenerate=converged and not is_ambiguous,
        check=decisive,
        unused=tuple(unused),
    )


def checked_by(
    depth: NDArray[np.float32],
    camera: Intrinsics,
    model: ViewpointModel,
    T_camera_centre: Array,
    held_out: bool,
    explained: NDArray[np.bool_] | None = None,
) -> Check:
    """Compare an object at a pose with a depth image (H, W), metres.

    Args:
        held_out: whether to look at the pixels alone that a snap leaves unread where it reduces the image;
            else at all, as in a view that was not used.
        explained: (H, W), the pixels of known objects: they hide, and are no part of what is sought.
    """
    inverse_depth = np.zeros((camera.height, camera.width))
    vertices = pose.apply(T_camera_centre, model.coarse_vertices.astype(np.float64))
    bounds = draw_mesh(
        vertices, model.coarse_faces, camera.fx, camera.fy, camera.cx, camera.cy, inverse_depth, None,
        not model.coarse_is_closed,
    )  # fmt: skip
    known = np.zeros((0, 0), np.bool_) if explained is None else explained
    pixels, seen, matches, behind, before = _count(inverse_depth, depth, known, bounds, held_out)
    measured = max(seen, 1)
    return Check(
        pixels=pixels,
        seen=seen / max(pixels, 1),
        match=matches / measured,
        behind=len(behind) / measured,
        behind_by=float(np.median(behind)) if len(behind) else 0.0,
        before=len(before) / measured,
        before_by=float(np.median(before)) if len(before) else 0.0,
    )


@njit(**EXACT)
def _count(inverse_depth, depth, known, bounds, held_out):
    """Pixels, those seen, those that match, and by how much the others lie behind and before the surface."""
    top, bottom, left, right = bounds
    pixels, seen, matches = 0, 0, 0
    most = max(bottom - top, 0) * max(right - left, 0)
    behind, before = np.empty(most), np.empty(most)
    n_behind, n_before = 0, 0
    for row in range(top, bottom):
        for column in range(left, right):
            if inverse_depth[row, column] == 0.0 or (held_out and not is_held_out(row, column)):
                continue
            pixels += 1
            measured = float(depth[row, column])
            if not 0.0 < measured < FARTHEST:
                continue
            surface = 1.0 / inverse_depth[row, column]
            tolerance = TOLERANCE * max(surface, 1.0) ** 2
            gap = measured - surface
            if gap < -HIDDEN or (known.size > 0 and known[row, column] and gap < CLEAR * tolerance):
                continue
            seen += 1
            if abs(gap) <= tolerance:
                matches += 1
            elif gap > CLEAR * tolerance:
                behind[n_behind] = gap
                n_behind += 1
            elif gap < -CLEAR * tolerance:
                before[n_before] = -gap
                n_before += 1
    return pixels, seen, matches, behind[:n_behind], before[:n_before]
