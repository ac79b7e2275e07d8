"""Which rotations map a mesh onto itself, measured on its surface: suggestions for a person to accept.

The axis of a symmetry passes through the centroid of the surface and is one of its principal axes, unless the
surface spreads alike along two or three of them: then more directions are tried. Each candidate is refined by
Gauss-Newton steps on closest points (point to plane: Chen and Medioni, 1992) and judged by how far its
rotations carry the surface off itself. That is the definition of BOP (Hodan et al., ECCV 2018, section 2.3),
with the 99th percentile of the distances in place of the largest, which one spike of a scan would decide.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from registration_core.geometry.object_model import ObjectModel
from registration_core.symmetry.group import (
    SAME_AXIS,
    SuggestedSymmetry,
    SymmetryAxis,
    angles_of,
    axis_rotations,
    flips,
    order,
    turns,
)

Array = NDArray[np.float64]

TOLERANCE = 0.02
"""Share of the diameter by which a symmetric surface may miss itself."""

PERCENTILE = 99.0
"""Of the distances: a handle is more than a hundredth of the surface, the spikes of a scan are less."""

HIGHEST_FOLD = 12
"""Of the discrete axes that are looked for."""

PRIMES = (2, 3, 5, 7, 11)
"""Each of those axes is also one of such an order."""

PLANE_DIRECTIONS = 60
"""Axes tried in a plane of like spread: 3 degrees apart."""

SPHERE_DIRECTIONS = 400
"""Axes tried where the spread is alike in all directions: about 7 degrees apart."""

MOST_MINIMA = 20
"""Best directions of each order that are refined, ..."""

LARGEST_MISS = 0.04
"""... where the mean miss is below this, diameters: an axis 4 degrees off a true one misses by less."""

COARSE, FINE, ALL, DENSE = 100, 200, 2000, 10_000
"""Samples that directions are compared with, axes refined, residuals measured; all stand for the surface."""

STEPS = 6
"""Of Gauss-Newton."""

MOST_ANGLES = 4
"""Angles that an axis is refined with."""

DAMPING = 1e-4
"""Of those steps: about a flip of a cylinder, say, one tilt changes nothing."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A mesh ready to be compared with itself, in units of its diameter, about the centroid of its area."""

    points: Array
    """(DENSE, 3), even random samples."""
    tree: Any
    """k-d tree of `points`: for a first look, in a quarter of the time."""
    scene: Any
    """The mesh as Open3D's ray caster has it, which knows closest points."""

    def closest(self, points: Array) -> tuple[Array, Array]:
        """Points of the mesh (..., 3) closest to `points` (..., 3), and its unit normals there (..., 3)."""
        answer = self.scene.compute_closest_points(points.astype(np.float32), nthreads=1)
        normals = np.nan_to_num(answer["primitive_normals"].numpy())  # a face without area has none
        return answer["points"].numpy().astype(np.float64), normals.astype(np.float64)

    def distances(self, transforms: Array, count: int) -> Array:
        """Distances (K, count) of the first points to the mesh, after each of `transforms` (K, 4, 4)."""
        moved = moved_by(transforms, self.points[:count])
        return self.scene.compute_distance(moved.astype(np.float32), nthreads=1).numpy()


def find_symmetries(
    mesh: ObjectModel | trimesh.Trimesh, tolerance: float = TOLERANCE
) -> tuple[SuggestedSymmetry, ...]:
    """The axes of symmetry of a mesh in metres, best first: least residual, then most rotations.

    Each axis comes once, with its highest fold. A solid of revolution has its axis and, if it can be turned
    over, one flip; a sphere has three axes at right angles. Colours are not looked at.

    Args:
        tolerance: largest residual, share of the diameter.

    Raises:
        ValueError: where `tolerance` is no share in (0, 0.1], or `mesh` is empty, not finite or has no area.
    """
    if not 0.0 < tolerance <= 0.1:
        raise ValueError(f"tolerance must be a share of the diameter in (0, 0.1]; it is {tolerance!r}")
    model = ObjectModel(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int32))
    triangles = model.vertices[model.faces]
    areas = trimesh.triangles.area(triangles)
    centroid = centroid_of(triangles, areas)
    surface = surface_of((model.vertices - centroid) / model.diameter, model.faces)
    spreads, axes = principal_axes((triangles - centroid) / model.diameter, areas)
    found: list[SuggestedSymmetry] = []
    for axis, prime in candidates(surface, spreads, axes, tolerance):
        if not implied(axis, prime, found):
            found += best_at(surface, axis, prime, tolerance)
    best_first = sorted(distinct(found), key=lambda s: (round(s.residual, 3), -order(s)))
    return tuple(
        SuggestedSymmetry(s.axis, s.origin * model.diameter + centroid, s.fold, s.residual * model.diameter)
        for s in best_first
    )


def residual_of(model: ObjectModel, axis: SymmetryAxis) -> float:
    """How far turns about an axis carry the surface off itself, metres, as `find_symmetries` measures it."""
    triangles = model.vertices[model.faces]
    centroid = centroid_of(triangles, trimesh.triangles.area(triangles))
    surface = surface_of((model.vertices - centroid) / model.diameter, model.faces)
    origin = (axis.origin - centroid) / model.diameter
    return model.diameter * residual(surface, axis.axis, origin, angles_of(axis.fold), ALL)


def centroid_of(triangles: Array, areas: Array) -> Array:
    """The centroid (3,) of a surface of triangles (F, 3, 3) with these areas (F,)."""
    return np.average(triangles.mean(axis=1), axis=0, weights=areas)


def surface_of(vertices: Array, faces: NDArray[np.int32]) -> Surface:
    """The Surface of a mesh; its samples are the same each time."""
    import open3d  # heavy, and needed only where a model is looked into

    mesh = trimesh.Trimesh(vertices, faces, process=False)
    points = np.asarray(trimesh.sample.sample_surface(mesh, DENSE, seed=0)[0])
    scene = open3d.t.geometry.RaycastingScene(nthreads=1)
    tensor: Any = open3d.core.Tensor
    scene.add_triangles(tensor(vertices.astype(np.float32)), tensor(faces.astype(np.uint32)))
    return Surface(points, cKDTree(points), scene)


def principal_axes(triangles: Array, areas: Array) -> tuple[Array, Array]:
    """Spread of a surface about the origin along its principal axes (3,), and these axes as rows (3, 3).

    The second moment of a triangle is its area / 12 times that of its corners and of three times its centre.
    """
    points = np.concatenate([triangles, 3.0 * triangles.mean(axis=1, keepdims=True)], axis=1)
    moments, axes = np.linalg.eigh(np.einsum("f,fki,fkj->ij", areas / (12.0 * areas.sum()), points, points))
    return np.sqrt(np.maximum(moments, 0.0)), axes.T


def candidates(
    surface: Surface, spreads: Array, axes: Array, tolerance: float
) -> Iterator[tuple[Array, int]]:
    """Axes (3,) that may be ones of symmetry, each with the prime order that speaks for it.

    A symmetry carries the spread along one direction into that along another. It changes by no more than the
    surface moves: axes whose spreads differ by more than twice the tolerance do not change places.
    """
    for k, axis in enumerate(axes):
        across_alike = np.ptp(np.delete(spreads, k)) < 2.0 * tolerance
        yield from ((axis, prime) for prime in (PRIMES if across_alike else (2,)))
    alike = np.diff(spreads) < 2.0 * tolerance
    if alike.all():
        directions = hemisphere(SPHERE_DIRECTIONS)
        for prime in PRIMES:
            yield from ((axis, prime) for axis in minima(surface, directions, prime))
    elif alike.any():
        first = int(np.argmax(alike))
        angles = np.pi * np.arange(PLANE_DIRECTIONS)[:, None] / PLANE_DIRECTIONS
        directions = np.cos(angles) * axes[first] + np.sin(angles) * axes[first + 1]
        yield from ((axis, 2) for axis in minima(surface, directions, 2))


def hemisphere(count: int) -> Array:
    """Unit vectors (count, 3), evenly over half a sphere (Fibonacci lattice)."""
    z = (np.arange(count) + 0.5) / count
    angle = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    radius = np.sqrt(1.0 - z**2)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)


def minima(surface: Surface, directions: Array, prime: int) -> Array:
    """Those of `directions` (D, 3) about which a turn misses the surface less than about their neighbours."""
    transforms = turns(directions, np.zeros(3), np.array([2.0 * np.pi / prime]))
    moved = moved_by(transforms, surface.points[:COARSE])
    misses = surface.tree.query(moved)[0].mean(axis=1)
    apart = np.abs(directions @ directions.T)
    spacing = np.sort(apart, axis=1)[:, -3].min()  # cosine of the angle to the second nearest
    lowest = np.where(apart >= 2.0 * spacing**2 - 1.0, misses, LARGEST_MISS).min(axis=1)
    local = np.flatnonzero(misses <= lowest)
    return directions[local[np.argsort(misses[local], kind="stable")[:MOST_MINIMA]]]


def best_at(surface: Surface, axis: Array, prime: int, tolerance: float) -> list[SuggestedSymmetry]:
    """The symmetry with the most rotations about an axis near `axis` (3,), if there is one, in diameters."""
    axis, origin = refined(surface, axis, np.zeros(3), angles_of(prime), tolerance)
    if residual(surface, axis, origin, angles_of(prime)[:1], FINE) > 1.5 * tolerance:
        return []
    multiples = [fold for fold in range(HIGHEST_FOLD, 1, -1) if fold % prime == 0]
    for fold in (None, *multiples):
        angles = angles_of(fold)
        if residual(surface, axis, origin, angles[:1], FINE) > 2.0 * tolerance:
            continue
        fitted = refined(surface, axis, origin, angles, tolerance)
        missed = residual(surface, *fitted, angles, ALL)
        if missed <= tolerance:
            return [SuggestedSymmetry(*fitted, fold, missed)]
    return []


def residual(surface: Surface, axis: Array, origin: Array, angles: Array, count: int) -> float:
    """The largest over `angles` (A,) of the percentile of distances, diameters."""
    distances = surface.distances(turns(axis, origin, angles), count)
    return float(np.percentile(distances, PERCENTILE, axis=1).max())


def refined(
    surface: Surface, axis: Array, origin: Array, angles: Array, tolerance: float
) -> tuple[Array, Array]:
    """The axis (3,) and its point nearest to the centroid (3,), moved so that turns miss the surface least.

    A tilt w and a shift v of the axis move the turned point y = R x + o by w x R x - R (w x x) + v - R v.
    Parts of the surface that miss by far more than the tolerance count little (Cauchy weights).
    """
    points = surface.points[:FINE]
    for _ in range(STEPS):
        across = np.linalg.svd(axis[None])[2][1:]
        R = axis_rotations(axis, angles[:MOST_ANGLES])
        x = points - origin
        y = x @ R.swapaxes(1, 2)
        closest, normals = surface.closest(y + origin)
        misses = np.sum(normals * (y + origin - closest), axis=2).ravel()
        turned_back = normals @ R
        tilt = np.cross(y, normals) - np.cross(x, turned_back)
        shift = normals - turned_back
        J = np.concatenate([tilt @ across.T, shift @ across.T], axis=2).reshape(-1, 4)
        weighted = J.T / (1.0 + (misses / tolerance) ** 2)
        H = weighted @ J
        step = np.linalg.solve(H + DAMPING * max(np.trace(H), 1.0) * np.eye(4), -weighted @ misses)
        axis = Rotation.from_rotvec(step[:2] @ across).apply(axis)
        origin = origin + step[2:] @ across
        origin = origin - axis * (axis @ origin)
    return axis, origin


def moved_by(transforms: Array, points: Array) -> Array:
    """Points (K, N, 3): all of `points` (N, 3) after each of `transforms` (K, 4, 4)."""
    return points @ transforms[:, :3, :3].swapaxes(1, 2) + transforms[:, None, :3, 3]


def implied(axis: Array, prime: int, found: Sequence[SuggestedSymmetry]) -> bool:
    """Whether nothing new can be found near this axis; a solid of revolution has its axis, and flips."""
    for known in found:
        parallel = abs(axis @ known.axis)
        same = parallel > np.cos(SAME_AXIS)
        if known.fold is None and (same or parallel > np.sin(SAME_AXIS)):
            return True
        if known.fold is not None and same and known.fold % prime == 0:
            return True
    return False


def distinct(found: Sequence[SuggestedSymmetry]) -> list[SuggestedSymmetry]:
    """Each axis once, with the most rotations; with an axis of revolution, one flip and nothing else."""
    kept: list[SuggestedSymmetry] = []
    for suggestion in sorted(found, key=lambda s: (-order(s), s.residual)):
        if not any(abs(suggestion.axis @ known.axis) > np.cos(SAME_AXIS) for known in kept):
            kept.append(suggestion)
    round_axes = [s for s in kept if s.fold is None]
    return [*round_axes, *flips(kept, round_axes[0])[:1]] if round_axes else kept
