"""The measured points in a 3-D view: all of them, or few large ones, and finer ones near the object."""

from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

Array = NDArray[np.float64]

COARSE_POINTS = 20_000
"""Of a cloud that is not fine: software draws some 700,000 points a second."""
NEAR = 0.9
"""So near the object's middle, in its diameters, points are finer, ..."""
NEAR_POINTS = 8_000
"""... at most so many of the coarse ones, ..."""
MOVED_ON = 0.3
"""... until it has moved by more than this, in its diameters."""


@dataclass(frozen=True)
class _Points:
    """Points that are drawn alike."""

    places: NDArray[np.float32]
    """(N, 3), in the world, metres."""
    colors: NDArray[np.uint8]
    """(N, 3)."""
    size: float
    """Metres."""

    def where(self, chosen: NDArray[np.bool_] | NDArray[np.intp], larger: float = 1.0) -> "_Points":
        """Some of them."""
        return _Points(self.places[chosen], self.colors[chosen], self.size * larger)

    def thinned(self, most: int) -> "_Points":
        """At most so many of them, at random, as large as to cover what all of them cover."""
        count = len(self.places)
        if count <= most:
            return self
        chosen = np.random.default_rng(0).choice(count, most, replace=False)
        return self.where(chosen, float(np.sqrt(count / most)))


class CloudView:
    """The part of a viser scene that shows what was measured.

    Args:
        server: Whose scene it is.
        diameter: Of the object, metres.
    """

    def __init__(self, server: viser.ViserServer, diameter: float) -> None:
        self._scene = server.scene
        self._diameter = diameter
        self._kept: _Points | None = None
        """All points while few of them are drawn; what is drawn, viser keeps."""
        self._nodes: list[viser.PointCloudHandle] = []
        self._is_fine = True
        self._is_visible = True
        self._object = np.zeros(3)
        self._drawn_about = self._object

    def show(self, points: NDArray[np.float32], colors: NDArray[np.uint8], point_size: float) -> None:
        """Show points (N, 3) in the world, metres, in place of those before."""
        self._draw(_Points(points, colors, point_size))

    def show_as(self, is_visible: bool, is_fine: bool) -> None:
        """Show or hide them, all or few."""
        was_fine, self._is_fine, self._is_visible = self._is_fine, is_fine, is_visible
        for node in self._nodes:
            node.visible = is_visible
        if is_fine != was_fine and self._nodes:
            self._draw(self._all())

    def follow(self, object_centre: Array) -> None:
        """The object is here (3,) now: points near it are finer."""
        self._object = object_centre
        moved = float(np.linalg.norm(object_centre - self._drawn_about))
        if not self._is_fine and self._nodes and moved > MOVED_ON * self._diameter:
            self._draw(self._all())

    def _all(self) -> _Points:
        if self._kept is not None:
            return self._kept
        (node,) = self._nodes
        return _Points(node.points.astype(np.float32), node.colors, float(node.point_size))

    def _draw(self, points: _Points) -> None:
        self._kept = None if self._is_fine else points
        self._drawn_about = self._object
        far, near = (points, None) if self._is_fine else self._parted(points)
        before = self._nodes
        self._nodes = [self._add("/cloud", far)]
        if near is not None and len(near.places):
            self._nodes.append(self._add("/cloud-near", near))
        for node in before[len(self._nodes) :]:
            node.remove()

    def _parted(self, points: _Points) -> tuple[_Points, _Points]:
        """The coarse cloud: what is far from the object, and what is near."""
        is_near = np.linalg.norm(points.places - self._object, axis=1) < NEAR * self._diameter
        near = points.where(is_near).thinned(NEAR_POINTS)
        return points.where(~is_near).thinned(COARSE_POINTS - len(near.places)), near

    def _add(self, name: str, points: _Points) -> viser.PointCloudHandle:
        return self._scene.add_point_cloud(
            name,
            points.places,
            points.colors,
            point_size=points.size,
            point_shape="circle",
            precision="float32",
            visible=self._is_visible,
        )
