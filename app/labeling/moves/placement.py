"""Where an object goes by means other than dragging: nudged, turned, put down, placed at a click.

Poses are T_world_object (4, 4); points are (N, 3) and lengths metres, all in the world's frame unless said
otherwise. A plane is (4,): its unit normal n and an offset d with n . p + d = 0; n points to whoever sees it.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from registration_core import Intrinsics, ObjectModel
from registration_core.geometry import pose
from registration_core.geometry.camera import depth_to_points

Array = NDArray[np.float64]

PLANE_THRESHOLD = 0.005
"""Metres: points that far from a plane belong to it; depth sensors are off by 1 to 3 mm at a metre."""
PLANE_TRIES = 500
"""Three points drawn at random so often hit a plane that holds a fifth of the points with 98 %."""
PLANES_LOOKED_AT = 3
"""The surface below a large object is not always the largest plane near it: its own side may be."""
LEAST_PLANE_SHARE = 0.1
"""Of the points nearby: fewer are no surface that an object stands on."""
BENEATH_WEIGHT = 4.0
"""How much more a point beneath a plane says against it than one on the plane says for it."""
LEAST_POINTS = 100
MOST_POINTS = 10_000
"""More make a plane no better, only slower."""
REACH = (3.0, 0.1)
"""How far around an object its surface is looked for: so many radii, and so many metres more."""
PICKED_PIXELS = 2
"""The depth of a clicked pixel is the median over so many to each side: depth has holes, and edges fray."""
PICKED_ANGLE = 0.006
"""Radians: points that near to a ray are under the pointer, about four pixels of the 3-D view."""
LARGEST_PICKED_ANGLE = 0.03
"""Radians; where the cloud is drawn that large, there is space between its points."""


def nudged(T_world_object: Array, axes: Array, translation: Array, rotation: Array, pivot: Array) -> Array:
    """The object moved, and turned about its pivot, along given axes.

    Args:
        T_world_object: Where it is.
        axes: (3, 3), the axes as columns.
        translation: (3,), along the axes.
        rotation: (3,), rotation vector in the axes, radians.
        pivot: (3,), in the object's frame: it only shifts.
    """
    R = Rotation.from_rotvec(axes @ rotation).as_matrix()
    centre = pose.apply(T_world_object, pivot)
    turned = pose.from_rotation_translation(
        R @ T_world_object[:3, :3], centre + R @ (T_world_object[:3, 3] - centre)
    )
    return shifted(turned, axes @ translation)


def shifted(T_world_object: Array, shift: Array) -> Array:
    """The object moved by (3,) in the world."""
    return pose.from_rotation_translation(T_world_object[:3, :3], T_world_object[:3, 3] + shift)


def rested(T_world_object: Array, vertices: Array, plane: Array) -> Array:
    """The object moved along a plane's normal until its lowest vertex touches the plane.

    Args:
        T_world_object: Where it is.
        vertices: (V, 3), in the object's frame.
        plane: What it is put down on.
    """
    lowest = height(pose.apply(T_world_object, vertices), plane).min()
    return shifted(T_world_object, -lowest * plane[:3])


def placed(T_world_object: Array, model: ObjectModel, point: Array, eye: Array, plane: Array | None) -> Array:
    """The object at a point that somebody who looks from `eye` pointed at; its rotation is kept.

    Who points at the bare surface wants the object to stand there: its centre comes to lie above the point,
    and its lowest vertex touches the surface. Who points at anything above the surface points at the object
    itself as the camera sees it: its centre comes to lie on the ray, and its surface meets the point.

    Args:
        T_world_object: Where it is; of this only the rotation matters.
        model: The object.
        point: (3,).
        eye: (3,), where the ray begins.
        plane: The surface that things stand on near the point; None where there is none.
    """
    centre = pose.apply(T_world_object, model.centre)
    if plane is not None and abs(height(point, plane)) < 2.0 * PLANE_THRESHOLD:
        return rested(shifted(T_world_object, point - centre), model.vertices, plane)
    ray = (point - eye) / np.linalg.norm(point - eye)
    before_centre = _surface_before_centre(model, T_world_object[:3, :3].T @ ray)
    return shifted(T_world_object, point + before_centre * ray - centre)


def supporting_plane(points: Array, eye: Array) -> Array | None:
    """The plane that things among the points stand on: many lie on it, and few beneath.

    Args:
        points: (N, 3), what was measured near an object.
        eye: (3,), the side from which they were.

    Returns:
        None where there is no such plane.
    """
    import open3d  # heavy, and needed only where an object is put down

    if len(points) < LEAST_POINTS:
        return None
    rest = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    best, best_worth = None, 0.0
    for _ in range(PLANES_LOOKED_AT):
        if len(rest.points) < LEAST_PLANE_SHARE * len(points):
            break
        equation, inliers = rest.segment_plane(PLANE_THRESHOLD, 3, PLANE_TRIES)
        if len(inliers) < LEAST_PLANE_SHARE * len(points):
            break
        plane = _towards(np.asarray(equation, dtype=np.float64), eye)
        beneath = np.count_nonzero(height(points, plane) < -2.0 * PLANE_THRESHOLD)
        worth = len(inliers) - BENEATH_WEIGHT * beneath
        if worth > best_worth:
            best, best_worth = plane, worth
        rest = rest.select_by_index(inliers, invert=True)
    return best


def nearby(points: Array, centre: Array, radius: float) -> Array:
    """Those of the points that may tell what an object of this centre (3,) and radius stands on."""
    near = points[np.linalg.norm(points - centre, axis=1) < REACH[0] * radius + REACH[1]]
    return near[:: max(1, len(near) // MOST_POINTS)]


def height(points: Array, plane: Array) -> Array:
    """Signed distances (...,) of points (..., 3) from a plane, positive on the side of its normal."""
    return points @ plane[:3] + plane[3]


def measured_points(depth: NDArray[np.float32], camera: Intrinsics, T_world_camera: Array) -> Array:
    """What a depth image (H, W) measured, as points."""
    return pose.apply(T_world_camera, depth_to_points(depth, camera)[depth > 0])


def point_at_pixel(
    depth: NDArray[np.float32], camera: Intrinsics, T_world_camera: Array, column: float, row: float
) -> Array | None:
    """The point (3,) that was measured at a pixel of a depth image (H, W); None where nothing was."""
    i, j = round(row), round(column)
    around = depth[
        max(i - PICKED_PIXELS, 0) : i + PICKED_PIXELS + 1, max(j - PICKED_PIXELS, 0) : j + PICKED_PIXELS + 1
    ]
    if not (around > 0).any():
        return None
    z = float(np.median(around[around > 0]))
    x, y = z * (column - camera.cx) / camera.fx, z * (row - camera.cy) / camera.fy
    return pose.apply(T_world_camera, [x, y, z])


def point_along_ray(points: Array, origin: Array, direction: Array) -> Array | None:
    """The first of the points under a ray: (3,), or None where it passes all of them.

    Args:
        points: The cloud.
        origin: (3,), the eye.
        direction: (3,), of any length.
    """
    from_eye = points - origin
    along = from_eye @ (direction / np.linalg.norm(direction))
    before, along = from_eye[along > 0], along[along > 0]
    across = np.sqrt(np.maximum((before**2).sum(axis=1) - along**2, 0.0))
    angle = np.arctan2(across, along)
    if angle.min(initial=np.inf) > LARGEST_PICKED_ANGLE:
        return None
    under = angle <= max(PICKED_ANGLE, angle.min())
    return origin + before[under][np.argmin(along[under])]


def _towards(equation: Array, eye: Array) -> Array:
    plane = equation / np.linalg.norm(equation[:3])
    return plane if height(eye, plane) >= 0 else -plane


def _surface_before_centre(model: ObjectModel, ray: Array) -> float:
    """How far before the model's centre a ray through it, unit (3,) in the object's frame, meets the mesh.

    Where it meets none, as in the hole of a ring, the vertex that comes first along the ray counts.
    """
    import open3d  # heavy, and needed only where an object is placed

    scene = open3d.t.geometry.RaycastingScene(nthreads=1)
    tensor = open3d.core.Tensor
    scene.add_triangles(
        tensor.from_numpy(model.vertices.astype(np.float32)), tensor.from_numpy(model.faces.astype(np.uint32))
    )
    start = 2.0 * model.radius
    line = np.concatenate([model.centre - start * ray, ray]).astype(np.float32)
    hit = float(scene.cast_rays(tensor.from_numpy(line[None]))["t_hit"].numpy()[0])
    first_vertex = float(((model.centre - model.vertices) @ ray).max())
    return start - hit if np.isfinite(hit) else first_vertex
