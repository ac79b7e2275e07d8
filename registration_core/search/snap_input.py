"""The inputs of a snap: checked, and brought into the form that the search works on."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from registration_core.config import SnapConfig, SpreadConfig
from registration_core.geometry import pose
from registration_core.geometry.camera import Intrinsics
from registration_core.geometry.kernels import Array32, centred, f4, from_rows, to_rows, uncentred
from registration_core.search.color_edges import checked_color
from registration_core.search.observation import window
from registration_core.search.sparse_score import Prior
from registration_core.search.viewpoint_model import Registrable, ViewpointModel, viewpoint_model

Array = NDArray[np.float64]

FARTHEST = 30.0
"""Metres; a median depth beyond this is taken for millimetres."""


class OutOfViewError(ValueError):
    """The pose puts the object wholly outside the image."""


SAMPLE = 5_000
"""Pixels by which the unit of a depth image is told."""

LEAST_SPREAD = (0.003, np.radians(3.0))
"""Metres and radians: no start is trusted more than this."""


@dataclass(frozen=True, eq=False)
class SnapInput:
    """One registration to be done; `T_camera_centre` poses turn about the centre of the object's bounding
    box.
    """

    model: ViewpointModel
    depth: NDArray[np.float32]
    """(H, W), metres; what is not a positive number counts as not measured."""
    camera: Intrinsics
    T_camera_object: Array
    """(4, 4), the operator's pose."""
    start: Array
    """(4, 4), the same as `T_camera_centre`."""
    prior: Prior
    search: Prior
    """The Gaussian that proposals are drawn from: `spread` times `config.spread.search`."""
    config: SnapConfig
    explained: NDArray[np.bool_] | None = None
    """(H, W), the pixels of known objects; None where there are none."""
    color: NDArray[np.uint8] | None = None
    """(H, W, 3), aligned with the depth; None where there is none."""

    @property
    def spread(self) -> tuple[float, float]:
        """How far off the start may be, metres and radians: what the caller said, or the default."""
        factor = self.config.spread.search
        return float(self.search.translation) / factor, float(self.search.rotation) / factor

    def uncentred(self, T_camera_centre: Array) -> Array:
        """`T_camera_object` of poses (..., 4, 4), exactly rigid."""
        return uncentred(pose.orthonormalised(T_camera_centre), self.model.centre)

    def uncentred_particles(self, rows: Array32) -> Array:
        """`T_camera_object` (N, 4, 4) of poses (N, 3, 4), rigid up to the rounding of float32."""
        return uncentred(from_rows(rows), self.model.centre)


def checked_problem(
    model: Registrable,
    depth: ArrayLike,
    camera: Intrinsics,
    T_camera_object: ArrayLike,
    config: SnapConfig,
    start_spread: tuple[float, float] | None,
    explained: ArrayLike | None = None,
    color: ArrayLike | None = None,
) -> SnapInput:
    """The inputs of `snap` as a SnapInput.

    Raises:
        ValueError: naming the argument that is wrong, and how.
    """
    T = pose.checked(T_camera_object, "T_camera_object")
    return snap_input_of(model, checked_view(depth, camera, explained, color), T, config, start_spread)


class CheckedView(NamedTuple):
    """A view whose images are what they should be."""

    depth: NDArray[np.float32]
    camera: Intrinsics
    explained: NDArray[np.bool_] | None
    color: NDArray[np.uint8] | None


def checked_view(
    depth: ArrayLike, camera: Intrinsics, explained: ArrayLike | None, color: ArrayLike | None
) -> CheckedView:
    """The images of one view; raises a ValueError that says which is wrong, and how."""
    image = checked_depth(depth, camera)
    mask = None if explained is None else checked_mask(explained, camera)
    return CheckedView(image, camera, mask, None if color is None else checked_color(color, image.shape))


def snap_input_of(
    model: Registrable,
    view: CheckedView,
    T_camera_object: Array,
    config: SnapConfig,
    start_spread: tuple[float, float] | None,
) -> SnapInput:
    """What is to be done in a view from a rigid pose (4, 4).

    Raises:
        OutOfViewError: where no part of the object can be in the image.
        ValueError: where `start_spread` is none.
    """
    viewpoints = viewpoint_model(model)
    start = centred(T_camera_object, viewpoints.centre)
    check_in_view(viewpoints, view.camera, start)
    prior, search = _priors(start, config.spread, start_spread)
    return SnapInput(
        viewpoints, view.depth, view.camera, T_camera_object, start, prior, search, config,
        view.explained, view.color,
    )  # fmt: skip


def region_of_interest(
    model: Registrable, camera: Intrinsics, T_camera_object: ArrayLike, config: SnapConfig
) -> tuple[int, int, int, int]:
    """(left, top, width, height) of the pixels that a snap from this pose may look at.

    A snap on that part of the image, with `camera.cropped(...)`, gives the same estimate as one on the
    whole image, if the part holds any measurement: an image without any is refused.

    Raises:
        ValueError: where the pose is none, or the object lies wholly outside the image.
    """
    T = pose.checked(T_camera_object, "T_camera_object")
    centre = pose.apply(T, model.centre)
    left, top, right, bottom = window(camera, centre, model.radius, config.observation.reach)
    if left >= right or top >= bottom or centre[2] <= -model.radius:
        raise ValueError("T_camera_object puts the object wholly outside the image")
    return left, top, right - left, bottom - top


def checked_depth(depth: ArrayLike, camera: Intrinsics) -> NDArray[np.float32]:
    """The depth image (H, W) as float32, as it is; what is not a positive number counts as not measured.

    Raises:
        ValueError: where its shape is not the camera's, it holds no depth, or it seems to be in millimetres.
    """
    try:
        image = np.ascontiguousarray(depth, dtype=np.float32)
    except (TypeError, ValueError):
        raise ValueError("depth must be an image of numbers") from None
    if image.shape != (camera.height, camera.width):
        raise ValueError(
            f"depth must have the shape (height, width) of the camera, {(camera.height, camera.width)};"
            f" it has {image.shape}"
        )
    step = max(1, math.isqrt(image.size // SAMPLE))
    sample = image[step // 2 :: step, step // 2 :: step]
    measured = sample[np.isfinite(sample) & (sample > 0)]
    if not len(measured):
        measured = image[np.isfinite(image) & (image > 0)]
    if not len(measured):
        raise ValueError("depth must hold measurements; all of its pixels are 0")
    median = float(np.median(measured))
    if median > FARTHEST:
        raise ValueError(f"depth must be in metres; its median is {median:.6g}, which looks like millimetres")
    return image


def checked_mask(explained: ArrayLike, camera: Intrinsics) -> NDArray[np.bool_]:
    """The pixels (H, W) of known objects; raises a ValueError where they are no booleans of that shape."""
    mask = np.asarray(explained)
    if mask.dtype != np.bool_ or mask.shape != (camera.height, camera.width):
        raise ValueError(
            f"explained must be booleans of the shape (height, width) of the camera,"
            f" {(camera.height, camera.width)}; it has {mask.dtype} {mask.shape}"
        )
    return mask


def check_in_view(model: ViewpointModel, camera: Intrinsics, start: Array) -> None:
    """Raise a ValueError where no part of the object at `T_camera_centre` (4, 4) can be in the image."""
    points = pose.apply(start, model.coarse_vertices)
    points = points[points[:, 2] > 0.0]
    if len(points):
        columns = camera.fx * points[:, 0] / points[:, 2] + camera.cx
        rows = camera.fy * points[:, 1] / points[:, 2] + camera.cy
        inside_columns = columns.max() > -0.5 and columns.min() < camera.width - 0.5
        inside_rows = rows.max() > -0.5 and rows.min() < camera.height - 0.5
        if inside_columns and inside_rows:
            return
    raise OutOfViewError("T_camera_object puts the object wholly outside the image")


def _priors(
    start: Array, config: SpreadConfig, start_spread: tuple[float, float] | None
) -> tuple[Prior, Prior]:
    """What is believed of the start, and how wide the search is."""
    spread, belief = np.array([config.translation, config.rotation]), config.belief
    if start_spread is not None:
        spread, belief = np.asarray(start_spread, dtype=np.float64), 1.0
        if spread.shape != (2,) or not np.isfinite(spread).all() or (spread < 0).any():
            raise ValueError(
                f"start_spread must be (metres, radians), neither negative; it is {start_spread!r}"
            )
        spread = np.maximum(spread, LEAST_SPREAD)
    rows = to_rows(start)[0]
    prior, search = (factor * spread.astype(np.float32) for factor in (f4(belief), f4(config.search)))
    return Prior(rows, *prior), Prior(rows, *search)
