# mypy: allow-untyped-defs
"""What the compiled inner loops share: options, random numbers, small rotations, the choice of a view.

Kernels work on poses as (3, 4) float32 rows `[R | t]` of `T_camera_centre`, where the object's frame has been
moved to the centre of its bounding box, so that a rotation turns the object about its middle.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from registration_core.geometry import pose

Array32 = NDArray[np.float32]

EXACT = {"cache": True, "nogil": True, "error_model": "numpy"}
"""Options of kernels in IEEE arithmetic."""

FAST = {**EXACT, "fastmath": True}
"""Options of kernels whose sums may be reordered, so that they vectorise: still the same on every run."""

f4 = np.float32
"""Literals in kernels go through this, or float64 would creep in and halve the speed."""


def to_rows(T: NDArray[np.float64]) -> Array32:
    """Poses (..., 4, 4) as contiguous (N, 3, 4) float32 rows."""
    return np.ascontiguousarray(T.reshape(-1, 4, 4)[:, :3], dtype=np.float32)


def from_rows(rows: Array32) -> NDArray[np.float64]:
    """Rows (N, 3, 4) as poses (N, 4, 4), rigid up to the rounding of float32."""
    T = np.zeros((len(rows), 4, 4))
    T[:, :3] = rows
    T[:, 3, 3] = 1.0
    return T


def centred(T_camera_object: NDArray[np.float64], centre: NDArray[np.float64]) -> NDArray[np.float64]:
    """`T_camera_centre`: the same pose of the frame moved to `centre` (3,), metres, in the mesh frame."""
    return T_camera_object @ pose.from_rotation_translation(np.eye(3), centre)


def uncentred(T_camera_centre: NDArray[np.float64], centre: NDArray[np.float64]) -> NDArray[np.float64]:
    """The inverse of `centred`."""
    return T_camera_centre @ pose.from_rotation_translation(np.eye(3), -centre)


def random_state(rng: np.random.Generator) -> NDArray[np.uint64]:
    """State (1,) of `uniform` and `normal`."""
    return rng.integers(1, 2**63, size=1, dtype=np.uint64)


@njit(**FAST, inline="always")
def next_bits(state):
    """64 random bits by xorshift64*."""
    x = state[0]
    x ^= x >> np.uint64(12)
    x ^= x << np.uint64(25)
    x ^= x >> np.uint64(27)
    state[0] = x
    return x * np.uint64(2685821657736338717)


@njit(**FAST, inline="always")
def uniform(state):
    """A float32 in [0, 1)."""
    return f4(next_bits(state) >> np.uint64(40)) * f4(5.9604645e-08)


@njit(**FAST, inline="always")
def normal(state):
    """About a standard normal: four uniform numbers of 16 bits added and scaled to variance 1; never beyond
    3.5.
    """
    bits, mask = next_bits(state), np.uint64(0xFFFF)
    total = (
        (bits & mask)
        + ((bits >> np.uint64(16)) & mask)
        + ((bits >> np.uint64(32)) & mask)
        + (bits >> np.uint64(48))
    )
    return (f4(total) - f4(2 * 0xFFFF)) * f4(1.7320508 / 0xFFFF)


@njit(**FAST)
def turn(T, x, y, z, out):
    """Write T (3, 4) with its rotation turned by the rotation vector (x, y, z) in camera axes; t is kept."""
    angle = np.sqrt(x * x + y * y + z * z)
    if angle < f4(1e-7):
        out[:] = T
        return
    s = np.sin(angle) / angle
    c = (f4(1) - np.cos(angle)) / (angle * angle)
    m00, m01, m02 = f4(1) - c * (y * y + z * z), c * x * y - s * z, c * x * z + s * y
    m10, m11, m12 = c * x * y + s * z, f4(1) - c * (x * x + z * z), c * y * z - s * x
    m20, m21, m22 = c * x * z - s * y, c * y * z + s * x, f4(1) - c * (x * x + y * y)
    for j in range(3):
        a, b, d = T[0, j], T[1, j], T[2, j]
        out[0, j] = m00 * a + m01 * b + m02 * d
        out[1, j] = m10 * a + m11 * b + m12 * d
        out[2, j] = m20 * a + m21 * b + m22 * d
    out[:, 3] = T[:, 3]


@njit(**FAST)
def view_of(T, view_of_cell):
    """Index of the stored view nearest to the direction of the camera as seen from the object.

    Args:
        view_of_cell: (6, L, L), the view of every cell of a cube map.
    """
    x = -(T[0, 0] * T[0, 3] + T[1, 0] * T[1, 3] + T[2, 0] * T[2, 3])
    y = -(T[0, 1] * T[0, 3] + T[1, 1] * T[1, 3] + T[2, 1] * T[2, 3])
    z = -(T[0, 2] * T[0, 3] + T[1, 2] * T[1, 3] + T[2, 2] * T[2, 3])
    ax, ay, az = abs(x), abs(y), abs(z)
    if ax >= ay and ax >= az:
        face, u, v, size = (0 if x > 0 else 1), y, z, ax
    elif ay >= az:
        face, u, v, size = (2 if y > 0 else 3), x, z, ay
    else:
        face, u, v, size = (4 if z > 0 else 5), x, y, az
    cells = view_of_cell.shape[1]
    half = f4(0.5) * f4(cells) / max(size, f4(1e-9))
    row = min(cells - 1, max(0, int((u + size) * half)))
    column = min(cells - 1, max(0, int((v + size) * half)))
    return view_of_cell[face, row, column]


@njit(**FAST)
def squared_angle(A, B):
    """About the squared angle between the rotations of two poses (3, 4), rad^2."""
    trace = f4(0)
    for i in range(3):
        for j in range(3):
            trace += A[i, j] * B[i, j]
    return squared_angle_of(trace)


@njit(**FAST, inline="always")
def squared_angle_of(trace):
    """About the squared angle of a rotation with this trace, rad^2: exact to 1 % up to 1.8 rad."""
    x = f4(1.5) - f4(0.5) * trace
    return f4(2) * x + x * x * (f4(0.3333333) + x * (f4(0.0888889) + x * f4(0.0285714)))
