"""Draws what is not known about a pose into a 3-D view: an ellipsoid, and motions that depth cannot tell."""

import numpy as np
import viser
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from app.confidence.ambiguity_words import names_of_drawn
from app.confidence.uncertainty import Uncertainty, UnknownMotion

Array = NDArray[np.float64]

LEAST_SHOWN = 0.001
"""Metres: a shorter ellipsoid is as good as a point."""
AXIS_LENGTH = 0.8
"""To either side of the object's middle, as a share of its diameter."""
ARC_RADIUS = 0.62
"""As a share of the diameter, so that it lies outside the object."""
TICK = 0.08
"""Half the length of the marks at the ends of a motion, as a share of the diameter."""
LINE_WIDTH = 3.0
"""Pixels."""
OPACITY = 0.45
RADIANS_A_PIECE = 0.1
LABEL_SCALE = 0.8
"""Of the names of motions."""


class UncertaintyView:
    """The part of a viser scene that shows uncertainty; it can be hidden without being forgotten."""

    def __init__(self, server: viser.ViserServer, color: tuple[int, int, int], diameter: float) -> None:
        self._scene = server.scene
        self._color = color
        self._diameter = diameter
        self._root = self._scene.add_frame("/uncertainty", show_axes=False)
        self._nodes: list[viser.SceneNodeHandle] = []

    @property
    def visible(self) -> bool:
        """Whether it is shown where there is something to show."""
        return bool(self._root.visible)

    @visible.setter
    def visible(self, visible: bool) -> None:
        self._root.visible = visible

    def show(self, uncertainty: Uncertainty | None) -> None:
        """Show this in place of what was shown; None shows nothing."""
        for node in self._nodes:
            node.remove()
        self._nodes = []
        if uncertainty is None:
            return
        if uncertainty.translation >= LEAST_SHOWN:
            self._nodes.append(self._add_ellipsoid(uncertainty))
        if uncertainty.unknown:
            lines = [lines_of(motion, uncertainty.centre, self._diameter) for motion in uncertainty.unknown]
            self._nodes.append(self._add_lines(np.concatenate(lines)))
        if len(uncertainty.unknown) > 1:  # or nobody could tell which is which
            names = names_of_drawn(uncertainty.unknown)
            self._nodes += [self._add_name(name, line[0, 1]) for name, line in zip(names, lines, strict=True)]

    def _add_ellipsoid(self, uncertainty: Uncertainty) -> viser.IcosphereHandle:
        lengths = np.linalg.norm(uncertainty.ellipsoid, axis=0)
        axes = uncertainty.ellipsoid / np.maximum(lengths, 1e-12)
        if np.linalg.det(axes) < 0:
            axes[:, 0] *= -1.0
        x, y, z = np.maximum(lengths, 1e-5).tolist()
        return self._scene.add_icosphere(
            "/uncertainty/ellipsoid",
            color=self._color,
            opacity=OPACITY,
            scale=(x, y, z),
            wxyz=Rotation.from_matrix(axes).as_quat(scalar_first=True),
            position=uncertainty.centre,
            cast_shadow=False,
            receive_shadow=False,
        )

    def _add_name(self, name: str, at: Array) -> viser.LabelHandle:
        return self._scene.add_label(
            f"/uncertainty/{name.replace(' ', '-')}", name, position=at, font_screen_scale=LABEL_SCALE
        )

    def _add_lines(self, segments: Array) -> viser.LineSegmentsHandle:
        return self._scene.add_line_segments(
            "/uncertainty/motions",
            segments.astype(np.float32),
            self._color,
            thickness=LINE_WIDTH,
            thickness_units="screen",
        )


def lines_of(unknown: UnknownMotion, centre: Array, diameter: float) -> Array:
    """The axis of a motion and how far it goes, as segments (N, 2, 3) in the world, metres.

    A turn is an arc around the axis, a shift a piece of it, each with marks at its ends.
    """
    axis = unknown.axis / np.linalg.norm(unknown.axis)
    across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    across /= np.linalg.norm(across)
    begin = -unknown.extent if unknown.kind == "free motion" else 0.0
    tick = TICK * diameter
    half = AXIS_LENGTH * diameter * axis
    if unknown.motion == "shift":
        ends = centre + np.outer([begin, unknown.extent], axis)
        marks = [[end - tick * across, end + tick * across] for end in ends]
        return np.array([[centre - half, centre + half], ends, *marks])
    angles = np.linspace(begin, unknown.extent, 2 + int((unknown.extent - begin) / RADIANS_A_PIECE))
    spokes = Rotation.from_rotvec(np.outer(angles, axis)).apply(across)
    arc = centre + ARC_RADIUS * diameter * spokes
    marks = [
        [end - tick * spoke, end + tick * spoke]
        for end, spoke in zip(arc[[0, -1]], spokes[[0, -1]], strict=True)
    ]
    return np.concatenate([[[centre - half, centre + half]], np.stack([arc[:-1], arc[1:]], axis=1), marks])
