"""The pose of an object from pairs of clicked points: one on its mesh, one on what the camera saw.

Three clicks as in Marion et al., "Label Fusion" (ICRA 2018); the fit is that of Kabsch (1976) and Umeyama
(1991) without scale. How far off it may be follows from the click noise to first order, and is what
`snap(..., start_spread=...)` wants to know.
"""

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.distance import pdist, squareform

from registration_core.geometry import pose

Array = NDArray[np.float64]

CLICK_NOISE = 0.005
"""Metres: standard deviation, along each axis, of how far the two clicks of a pair miss each other."""

LARGEST_MISFIT = 4.0 * np.sqrt(2.0)
"""In click noises: what noise alone will not do to the distance of two picks (four standard deviations)."""

LEAST_SCATTER = 2.0
"""In click noises: picks nearer to one line than this leave the turn about it unknown to half a radian."""


@dataclass(frozen=True, eq=False)
class Correspondence:
    """The pose that clicked pairs agree on, and how far to trust it."""

    T_camera_object: Array
    """(4, 4)."""
    residuals: Array
    """(N,), metres: by how far each pair still misses."""
    rms: float
    """Root mean square of the residuals, metres."""
    start_spread: tuple[float, float]
    """(metres, radians), root mean square: how far off the pose may be."""


def pose_from_correspondences(
    points_object: ArrayLike,
    points_camera: ArrayLike,
    click_noise: float = CLICK_NOISE,
    centre: ArrayLike = (0.0, 0.0, 0.0),
) -> Correspondence:
    """The rigid pose that brings points of the object nearest, in least squares, to those in the camera.

    Args:
        points_object: (N, 3), N >= 3, metres, in the object's frame.
        points_camera: (N, 3), metres, in camera axes, in the same order.
        click_noise: standard deviation of a pair along each axis, metres.
        centre: (3,), in the object's frame: the point whose position the spread tells of. A snap turns about
            `model.centre`.

    Raises:
        ValueError: naming the argument, where there are too few points, points coincide or lie on a line, or
            the two sides differ by more than click noise explains; it then names the pair to click again.
    """
    if not (np.isfinite(click_noise) and click_noise > 0.0):
        raise ValueError(f"click_noise must be a length in metres above 0; it is {click_noise!r}")
    on_object = _checked(points_object, "points_object", click_noise)
    in_camera = _checked(points_camera, "points_camera", click_noise)
    if len(on_object) != len(in_camera):
        raise ValueError(
            "points_camera must hold as many points as points_object;"
            f" it has {len(in_camera)} and points_object {len(on_object)}"
        )
    about = np.asarray(centre, dtype=np.float64)
    if about.shape != (3,) or not np.isfinite(about).all():
        raise ValueError("centre must be one point (3,) of finite numbers")
    largest_misfit = LARGEST_MISFIT * click_noise
    _check_distances(on_object, in_camera, largest_misfit)
    T = _fit(on_object, in_camera)
    residuals = _misses(T, on_object, in_camera)
    if residuals.max() > largest_misfit:  # distances hardly tell a point off the plane of the others
        if _misses(_fit(on_object, in_camera, reflection=True), on_object, in_camera).max() <= largest_misfit:
            raise ValueError(
                "points_camera must not be the mirror image of points_object; check which belongs to which"
            )
        raise _misfit(int(residuals.argmax()), float(residuals.max()))
    T = pose.orthonormalised(T)
    freedom = 3 * len(residuals) - 6
    noise = max(click_noise, float(np.sqrt(np.sum(residuals**2) / freedom)))
    spread = _spread(pose.apply(T, on_object), pose.apply(T, about), noise)
    return Correspondence(T, residuals, float(np.sqrt(np.mean(residuals**2))), spread)


def _fit(on_object: Array, in_camera: Array, reflection: bool = False) -> Array:
    """Transform (4, 4) that brings the points of the object nearest to those in the camera."""
    T, _, _ = trimesh.registration.procrustes(on_object, in_camera, reflection=reflection, scale=False)
    return T


def _misses(T: Array, on_object: Array, in_camera: Array) -> Array:
    """Distances (N,) between the points of each pair under T (4, 4), metres."""
    return np.linalg.norm(pose.apply(T, on_object) - in_camera, axis=1)


def _spread(points: Array, centre: Array, noise: float) -> tuple[float, float]:
    """Root mean square error (metres, radians) of a fit to `points` (N, 3); the metres are those of `centre`.

    About the centroid the normal equations of shift and turn separate: their covariances are noise^2 / N and
    noise^2 times the inverse of the inertia; the turn then moves `centre` by its lever.
    """
    centroid = points.mean(axis=0)
    turn = noise**2 * np.linalg.inv(_inertia(points - centroid))
    lever = np.cross(np.eye(3), centre - centroid)
    shift = noise**2 / len(points) * np.eye(3) + lever @ turn @ lever.T
    return float(np.sqrt(np.trace(shift))), float(np.sqrt(np.trace(turn)))


def _inertia(points: Array) -> Array:
    """Inertia (3, 3) about the origin of unit masses at `points` (N, 3)."""
    return np.sum(points**2) * np.eye(3) - points.T @ points


def _checked(points: ArrayLike, name: str, click_noise: float) -> Array:
    """Points (N, 3) that can carry a pose, as float64."""
    try:
        checked = np.asarray(points, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be an array (N, 3) of numbers") from None
    if checked.ndim != 2 or checked.shape[1] != 3:
        raise ValueError(f"{name} must have the shape (N, 3); it has {checked.shape}")
    if len(checked) < 3:
        raise ValueError(f"{name} must hold three points or more; it holds {len(checked)}")
    if not np.isfinite(checked).all():
        raise ValueError(f"{name} must hold finite numbers only; it has a NaN or an infinity")
    apart = squareform(pdist(checked)) + np.diag(np.full(len(checked), np.inf))
    if apart.min() < click_noise:
        i, j = np.unravel_index(np.argmin(apart), apart.shape)
        raise ValueError(
            f"{name} must lie apart from each other; points {i + 1} and {j + 1} are {_mm(apart[i, j])} apart"
        )
    scatter = np.linalg.svd(checked - checked.mean(axis=0), compute_uv=False)
    if scatter[1] < LEAST_SCATTER * click_noise:
        raise ValueError(f"{name} must not lie on one line; click a point farther to the side")
    return checked


def _check_distances(on_object: Array, in_camera: Array, largest: float) -> None:
    """Raise a ValueError that names the pair without which the distances between the picks agree best."""
    differences = squareform(np.abs(pdist(on_object) - pdist(in_camera)))
    if differences.max() <= largest:
        return
    others = [np.delete(np.delete(differences, i, axis=0), i, axis=1).max() for i in range(len(differences))]
    worst = int(np.lexsort((-differences.sum(axis=1), others))[0])
    raise _misfit(worst, differences[worst].max())


def _misfit(pair: int, by: float) -> ValueError:
    """What to tell whoever clicked that pair."""
    return ValueError(
        f"points_camera must match points_object; pair {pair + 1} does not fit the others by {_mm(by)}:"
        " click it again"
    )


def _mm(length: float) -> str:
    """A length for people."""
    return f"{1000.0 * length:.0f} mm"
