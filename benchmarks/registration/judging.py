"""How wrong a pose is, and what is called right."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from registration_core import ObjectModel
from registration_core.geometry import pose, pose_error

Array = NDArray[np.float64]

ADD_SHARE, MSSD_SHARE = 0.10, 0.05
"""Of the diameter."""
CLOSE, CLOSE_ANGLE = 0.002, np.radians(2.0)
WORSE, WORSE_ANGLE = 0.003, np.radians(3.0)
"""Metres and radians: up to where a pose is good, and from where on a good one was made worse."""

ADD_POINTS = 1000
"""Of the mesh's vertices, for ADD and ADD-S."""


@dataclass(frozen=True)
class Error:
    """How wrong one pose is, its symmetries divided out."""

    add: float
    """ADD, or ADD-S where the object has symmetries, as a share of the diameter."""
    mssd: float
    """As a share of the diameter."""
    translation: float
    """Of the centre of the bounding box, metres."""
    rotation: float
    """Radians."""

    @property
    def is_right(self) -> bool:
        """ADD(-S) below 10 % of the diameter."""
        return self.add < ADD_SHARE

    @property
    def is_exact(self) -> bool:
        """MSSD below 5 % of the diameter: what a confidence speaks of."""
        return self.mssd < MSSD_SHARE

    @property
    def is_close(self) -> bool:
        """Within 2 mm and 2 degrees."""
        return self.translation < CLOSE and self.rotation < CLOSE_ANGLE

    @property
    def is_worse_than_good(self) -> bool:
        """Beyond 3 mm or 3 degrees."""
        return self.translation > WORSE or self.rotation > WORSE_ANGLE


class Judge:
    """Compares poses of one object with its true one."""

    def __init__(self, model: ObjectModel) -> None:
        self._model = model
        count = min(ADD_POINTS, len(model.vertices))
        chosen = np.random.default_rng(0).choice(len(model.vertices), count, replace=False)
        self._points = model.vertices[chosen]

    def error(self, T_estimate: Array, T_truth: Array) -> Error:
        """The error of a pose (4, 4); which symmetric twin of the truth is meant, each measure decides."""
        model, symmetries = self._model, self._model.symmetry_transforms
        twin = self._nearest_twin(T_estimate, T_truth)
        mean_distance = pose_error.adi if len(symmetries) > 1 else pose_error.add
        return Error(
            add=mean_distance(T_estimate, T_truth, self._points) / model.diameter,
            mssd=pose_error.mssd(T_estimate, T_truth, self._outermost, symmetries) / model.diameter,
            translation=float(
                np.linalg.norm(pose.apply(T_estimate, model.centre) - pose.apply(twin, model.centre))
            ),
            rotation=pose_error.rotation_error(T_estimate, twin),
        )

    def nearest_error(self, T_estimate: Array, truths: Sequence[Array]) -> Error:
        """The error against whichever of several true poses (4, 4) is nearest by ADD(-S)."""
        return min((self.error(T_estimate, T_truth) for T_truth in truths), key=lambda error: error.add)

    @cached_property
    def _outermost(self) -> Array:
        """Corners (K, 3) of the convex hull, which decide the MSSD."""
        return self._model.vertices[ConvexHull(self._model.vertices).vertices]

    def _nearest_twin(self, T_estimate: Array, T_truth: Array) -> Array:
        """The pose (4, 4) that looks like the truth and is turned least against the estimate."""
        twins = T_truth @ self._model.symmetry_transforms
        traces = np.einsum("ij,sij->s", T_estimate[:3, :3], twins[:, :3, :3])
        return twins[int(traces.argmax())]
