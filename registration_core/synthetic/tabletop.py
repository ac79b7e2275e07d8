"""Things on a table whose top is z = 0: stable poses, free places, and cameras around it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from registration_core.geometry import pose
from registration_core.geometry.object_model import ObjectModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Layout:
    """How crowded the table is, and where cameras stand around it."""

    radius: float = 0.10
    """Objects stand at most that far from the middle, metres; grows until everything has found a place."""
    growth: float = 1.01
    """Factor by which `radius` grows after a try that failed."""
    gap: float = 0.006
    """Least distance between things, seen from above, metres."""
    upright: float = 0.65
    """Share of objects that stand as they were modelled; the others lie in a stable pose."""
    elevation: tuple[float, float] = (0.45, 0.77)
    """Least and largest angle of a camera above the table, radians; lower ones see more occlusion."""
    distance: tuple[float, float] = (0.70, 0.90)
    """Least and largest distance of a camera from the middle, metres."""


@dataclass(frozen=True, eq=False)
class Placed:
    """A model somewhere on the table."""

    model: ObjectModel
    T_world_object: Array
    """(4, 4), metres."""


def place(
    models: Sequence[ObjectModel], rng: np.random.Generator, layout: Layout = Layout()
) -> tuple[Placed, ...]:
    """Put each model onto the table, the first near its middle; nothing touches anything else."""
    placed: list[Placed] = []
    footprints: list[Array] = []
    radius = layout.radius
    for model in models:
        T_world_object = set_down(model, resting_rotation(model, rng, layout.upright))
        footprint = seen_from_above(model, T_world_object)
        spot = random_spot(radius, rng)
        while not all(are_apart(footprint + spot, other, layout.gap) for other in footprints):
            radius *= layout.growth
            spot = random_spot(radius, rng)
        T_world_object[:2, 3] += spot
        placed.append(Placed(model, T_world_object))
        footprints.append(footprint + spot)
    return tuple(placed)


def resting_rotation(model: ObjectModel, rng: np.random.Generator, upright: float) -> Array:
    """A rotation (3, 3) in which the model rests: as modelled, or stable on another side; turned about z."""
    spin = Rotation.from_euler("z", rng.uniform(0.0, 2.0 * np.pi)).as_matrix()
    if rng.random() < upright:
        return spin
    downs, weights = stable_directions(model)
    down = downs[rng.choice(len(downs), p=weights)]
    tilt, _ = Rotation.align_vectors([[0.0, 0.0, -1.0]], [down])
    return spin @ tilt.as_matrix()


@lru_cache(maxsize=64)
def stable_directions(model: ObjectModel) -> tuple[Array, Array]:
    """Directions (K, 3) in the mesh frame that may point down at rest, and their probabilities (K,).

    A face of the convex hull is stable if the plumb line from the hull's centre of mass meets that face;
    it is as likely as it looks large from there.
    """
    hull = trimesh.convex.convex_hull(model.vertices)
    normals, corners, areas = hull.face_normals, hull.triangles[:, 0], hull.area_faces
    centre = hull.center_mass
    heights = np.einsum("ij,ij->i", corners - centre, normals)
    feet = centre + heights[:, None] * normals
    overhang = feet @ normals.T - np.einsum("ij,ij->i", corners, normals)
    stable = overhang.max(axis=1) < 1e-6
    weights = np.where(stable, areas / heights**2, 0.0)[stable]
    return normals[stable], weights / weights.sum()


def set_down(model: ObjectModel, R: Array) -> Array:
    """`T_world_object` of a model turned by R, in the middle of the table, its lowest point touching it."""
    turned = model.vertices @ R.T
    x, y, _ = (turned.min(axis=0) + turned.max(axis=0)) / 2.0
    return pose.from_rotation_translation(R, [-x, -y, -turned[:, 2].min()])


def random_spot(radius: float, rng: np.random.Generator) -> Array:
    """A point (2,) evenly from a disc about the middle."""
    distance, angle = radius * np.sqrt(rng.random()), rng.uniform(0.0, 2.0 * np.pi)
    return distance * np.array([np.cos(angle), np.sin(angle)])


def seen_from_above(model: ObjectModel, T_world_object: Array) -> Array:
    """Corners (K, 2) of the convex outline on the table, counter-clockwise, metres."""
    points = pose.apply(T_world_object, model.vertices)[:, :2]
    return points[ConvexHull(points).vertices]


def are_apart(a: Array, b: Array, gap: float) -> bool:
    """Whether a line separates two convex polygons (K, 2) by at least `gap` (separating axes)."""
    for polygon, other in ((a, b), (b, a)):
        edges = np.roll(polygon, -1, axis=0) - polygon
        outward = np.stack([edges[:, 1], -edges[:, 0]], axis=1) / np.linalg.norm(edges, axis=1, keepdims=True)
        clearance = (other @ outward.T).min(axis=0) - np.einsum("ij,ij->i", polygon, outward)
        if clearance.max() >= gap:
            return True
    return False


def look_at(eye: Array, target: Array, roll: float = 0.0) -> Array:
    """`T_world_camera` of a camera at `eye` (3,) that looks at `target`, world z up; roll in radians."""
    z = (target - eye) / np.linalg.norm(target - eye)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    R = np.stack([x, np.cross(z, x), z], axis=1)
    return pose.from_rotation_translation(R @ Rotation.from_euler("z", roll).as_matrix(), eye)


def cameras_around(count: int, rng: np.random.Generator, layout: Layout = Layout()) -> tuple[Array, ...]:
    """`T_world_camera` of `count` views that walk around the middle of the table."""
    start = rng.uniform(0.0, 2.0 * np.pi)
    views = []
    for k in range(count):
        azimuth = start + np.radians(50.0) * k + rng.uniform(-0.15, 0.15)
        elevation, distance = rng.uniform(*layout.elevation), rng.uniform(*layout.distance)
        direction = [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ]
        target = np.array([*rng.uniform(-0.02, 0.02, 2), 0.05])
        views.append(look_at(target + distance * np.array(direction), target, rng.uniform(-0.05, 0.05)))
    return tuple(views)
