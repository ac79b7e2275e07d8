"""Pinhole camera (OpenCV axes: x right, y down, z forward) and the way between depth images and points."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class Intrinsics:
    """A pinhole camera without distortion; pixel (0, 0) is the centre of the top-left pixel.

    Raises:
        ValueError: where a size or a focal length is not positive, or a number is not finite.
    """

    width: int
    """Columns, pixels."""
    height: int
    """Rows, pixels."""
    fx: float
    """Focal length along x, pixels."""
    fy: float
    """Focal length along y, pixels."""
    cx: float
    """Principal point, column."""
    cy: float
    """Principal point, row."""

    def __post_init__(self) -> None:
        if self.width <= 0 or self.height <= 0:
            raise ValueError(f"camera size must be positive; it is {self.width}x{self.height}")
        if not np.isfinite([self.fx, self.fy, self.cx, self.cy]).all():
            raise ValueError("camera fx, fy, cx and cy must be finite numbers")
        if self.fx <= 0 or self.fy <= 0:
            raise ValueError(f"camera focal lengths must be positive; fx is {self.fx}, fy is {self.fy}")

    @classmethod
    def from_matrix(cls, K: ArrayLike, width: int, height: int) -> "Intrinsics":
        """Camera from K, given as (3, 3) or as 9 numbers row by row.

        Raises:
            ValueError: where K is no upper triangular pinhole matrix without skew.
        """
        flat = np.asarray(K, dtype=np.float64).ravel()
        if flat.size != 9:
            raise ValueError(f"an intrinsics matrix must have 9 numbers, row by row; it has {flat.size}")
        matrix = flat.reshape(3, 3)
        if not np.allclose(matrix[[0, 1, 2, 2, 2], [1, 0, 0, 1, 2]], [0, 0, 0, 0, 1], atol=1e-6):
            raise ValueError(
                "an intrinsics matrix must have the form fx 0 cx / 0 fy cy / 0 0 1, without skew"
            )
        return cls(width, height, matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2])

    @property
    def matrix(self) -> NDArray[np.float64]:
        """K (3, 3)."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    def cropped(self, left: int, top: int, width: int, height: int) -> "Intrinsics":
        """The camera of the image part that starts at column `left` and row `top`; it may reach outside."""
        return Intrinsics(width, height, self.fx, self.fy, self.cx - left, self.cy - top)


def depth_to_points(depth: NDArray[np.floating], camera: Intrinsics) -> NDArray[np.float32]:
    """Points (H, W, 3) in camera axes, metres, of a depth image (H, W) in metres; 0 where depth is 0."""
    assert depth.shape == (camera.height, camera.width)
    columns = (np.arange(camera.width, dtype=np.float32) - camera.cx) / camera.fx
    rows = (np.arange(camera.height, dtype=np.float32) - camera.cy) / camera.fy
    z = depth.astype(np.float32)
    return np.stack([z * columns, z * rows[:, None], z], axis=-1).astype(np.float32)


def project(points: ArrayLike, camera: Intrinsics) -> NDArray[np.float64]:
    """Pixels (..., 2) as (column, row) of points (..., 3) in camera axes with z > 0."""
    p = np.asarray(points, dtype=np.float64)
    return np.stack(
        [
            camera.fx * p[..., 0] / p[..., 2] + camera.cx,
            camera.fy * p[..., 1] / p[..., 2] + camera.cy,
        ],
        axis=-1,
    )
