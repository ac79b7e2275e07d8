"""Which views of a scene a snap uses: those that see the object well, from different sides, best first."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from registration_core.geometry import pose
from registration_core.geometry.camera import Intrinsics, project
from registration_core.geometry.object_model import ObjectModel
from registration_core.rendering.rasterizer import draw_mesh

Array = NDArray[np.float64]
Camera = tuple[Intrinsics, Array]
"""A view's camera and its `T_world_camera` (4, 4)."""

LOOKED_AT = 10
"""Views whose depth is looked at, the most promising ones by their cameras: it has to be read."""
ACROSS = 24
"""Pixels that the object spans where it is drawn."""
RESOLVED = 40.0
"""Pixels that the object spans in an image from which on it is seen well: a snap reads hardly more of it."""
SLACK = 0.05
"""Metres: what was measured so much nearer than the object hides it, however far off the pose may be."""
LEAST_SEEN = 0.15
"""Share of the object that a view must show."""
ASIDE = np.radians(30.0)
"""Between views so far apart none says what another one has said."""
LEAST_GAIN = 0.1
"""A view that adds less than this, 1 for a whole object seen well and from a side of its own, is left out."""


def best_views(
    model: ObjectModel,
    cameras: Sequence[Camera],
    depth: Callable[[int], NDArray[np.float32]],
    T_world_object: Array,
    known: Sequence[tuple[ObjectModel, Array]],
    first: int,
    most: int,
) -> list[int]:
    """Indices of at most `most` views that see an object at about this pose (4, 4), best first.

    A view counts by the share of the object that it shows, how large, and how far aside it stands from those
    that were chosen before it.

    Args:
        model: may be coarse.
        depth: gives the depth image (H, W) in metres of a view; asked for LOOKED_AT of them.
        known: other objects with their `T_world_object` (4, 4), which hide what is behind them.
        first: the view that comes first if it sees the object at all.
    """
    centre = pose.apply(T_world_object, model.centre)
    directions = np.array([_direction(T_world_camera, centre) for _, T_world_camera in cameras])
    promise = np.array([_promise(camera, T, centre, model.radius) for camera, T in cameras])
    likely = _spread_out(promise, directions, first, LOOKED_AT)
    worth = np.zeros(len(cameras))
    for index in likely:
        camera, T_world_camera = cameras[index]
        T_camera_world = pose.inverse(T_world_camera)
        hiding = [(other, T_camera_world @ T) for other, T in known]
        shown = shown_share(model, camera, depth(index), T_camera_world @ T_world_object, hiding)
        worth[index] = shown * _resolution(camera, T_camera_world, centre, model.radius)
        worth[index] *= shown >= LEAST_SEEN
    return _spread_out(worth, directions, first, most)


def shown_share(
    model: ObjectModel,
    camera: Intrinsics,
    depth: NDArray[np.float32],
    T_camera_object: Array,
    known: Sequence[tuple[ObjectModel, Array]],
) -> float:
    """Share of an object at about this pose (4, 4) that is in the image, measured and not hidden."""
    centre = pose.apply(T_camera_object, model.centre)
    if centre[2] <= model.radius:
        return 0.0
    size = ACROSS + 2
    scale = ACROSS * centre[2] / (2.0 * model.radius)  # focal length of the drawing, pixels
    middle = (size - 1) / 2.0
    cx, cy = middle - scale * centre[0] / centre[2], middle - scale * centre[1] / centre[2]
    surface = _drawn(model, T_camera_object, scale, cx, cy, size)
    rows, columns = np.nonzero(surface)
    if not len(rows):
        return 0.0
    x, y = (columns - cx) / scale, (rows - cy) / scale
    u, v = np.rint(camera.fx * x + camera.cx), np.rint(camera.fy * y + camera.cy)
    inside = (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
    distance = 1.0 / surface[rows, columns]
    for other, T_camera_other in known:
        drawn = _drawn(other, T_camera_other, scale, cx, cy, size)[rows, columns]
        inside &= drawn * distance <= 1.0
    measured = depth[v[inside].astype(np.intp), u[inside].astype(np.intp)]
    return np.count_nonzero((measured > 0.0) & (measured > distance[inside] - SLACK)) / len(rows)


def _drawn(model: ObjectModel, T: Array, scale: float, cx: float, cy: float, size: int) -> Array:
    """Inverse depth (size, size), 1/m; 0 where the object is not."""
    drawn = np.zeros((size, size))
    draw_mesh(pose.apply(T, model.vertices), model.faces, scale, scale, cx, cy, drawn, None, True)
    return drawn


def _direction(T_world_camera: Array, centre: Array) -> Array:
    towards = T_world_camera[:3, 3] - centre
    unit: Array = towards / max(float(np.linalg.norm(towards)), 1e-9)
    return unit


def _promise(camera: Intrinsics, T_world_camera: Array, centre: Array, radius: float) -> float:
    """What a view may be worth at most, as far as its camera tells."""
    T_camera_world = pose.inverse(T_world_camera)
    x, y, z = pose.apply(T_camera_world, centre)
    if z <= radius:
        return 0.0
    column, row = project([x, y, z], camera)
    inside = 1.0
    for place, half, length in (
        (column, camera.fx * radius / z, camera.width),
        (row, camera.fy * radius / z, camera.height),
    ):
        inside *= max(0.0, min(place + half, length - 0.5) - max(place - half, -0.5)) / (2.0 * half)
    return inside * _resolution(camera, T_camera_world, centre, radius)


def _resolution(camera: Intrinsics, T_camera_world: Array, centre: Array, radius: float) -> float:
    """1 where the image resolves the object as well as a snap can use it."""
    z = max(float(pose.apply(T_camera_world, centre)[2]), 1e-6)
    return float(min(1.0, min(camera.fx, camera.fy) * 2.0 * radius / z / RESOLVED))


def _spread_out(worth: Array, directions: Array, first: int, most: int) -> list[int]:
    """At most so many views of the largest worth (N,), each worth the less the nearer its direction (N, 3) is
    to that of one before it.
    """
    gain, chosen = worth.copy(), list[int]()
    following = first if worth[first] > 0.0 else int(np.argmax(gain))
    while len(chosen) < most and gain[following] >= LEAST_GAIN:
        chosen.append(following)
        apart = np.arccos(np.clip(directions @ directions[following], -1.0, 1.0))
        gain = np.minimum(gain, worth * np.minimum(1.0, apart / ASIDE))
        gain[following] = 0.0
        following = int(np.argmax(gain))
    return chosen
