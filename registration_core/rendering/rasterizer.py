# mypy: allow-untyped-defs
"""Depth images of a mesh by a z-buffer on the CPU: exact, without OpenGL, fast for small images and
meshes.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from registration_core.geometry import pose
from registration_core.geometry.camera import Intrinsics
from registration_core.geometry.kernels import EXACT
from registration_core.geometry.object_model import ObjectModel

NEAR = 0.01
"""Near plane, metres: triangles are clipped there, not dropped."""


def render_depth(
    model: ObjectModel, camera: Intrinsics, T_camera_object: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Depth image (H, W) of the mesh in metres, 0 where there is none; both sides of a triangle are drawn.

    A pixel holds the depth z at its centre, where pixel (0, 0) is the centre of the top-left one.
    """
    inverse_depth = np.zeros((camera.height, camera.width))
    vertices = pose.apply(T_camera_object, model.vertices)
    draw_mesh(vertices, model.faces, camera.fx, camera.fy, camera.cx, camera.cy, inverse_depth, None, True)
    with np.errstate(divide="ignore"):
        return np.where(inverse_depth > 0.0, 1.0 / inverse_depth, 0.0).astype(np.float32)


@njit(**EXACT)
def draw_mesh(vertices, faces, fx, fy, cx, cy, inverse_depth, nearest_face, both_sides):
    """Draw triangles into `inverse_depth` (H, W), 1/m, which keeps the largest value (the nearest surface).

    Args:
        vertices: (V, 3), metres, camera axes.
        faces: (F, 3), indices of vertices.
        inverse_depth: float32 or float64.
        nearest_face: (H, W) int32, set to the index of the face that is seen, or None.
        both_sides: False for a closed mesh wound counter-clockwise seen from outside, of which only front
            sides can be seen: half of the work.

    Returns:
        (top, bottom, left, right) of the pixels that may have been drawn on, the ends exclusive.
    """
    height, width = inverse_depth.shape
    x, y, q = np.empty((3, vertices.shape[0]))
    left, right, top, bottom = np.inf, -np.inf, np.inf, -np.inf
    in_front = True
    for v in range(vertices.shape[0]):
        if vertices[v, 2] < NEAR:
            x[v] = y[v] = q[v] = 0.0
            in_front = False
            continue
        q[v] = 1.0 / vertices[v, 2]
        x[v] = fx * vertices[v, 0] * q[v] + cx
        y[v] = fy * vertices[v, 1] * q[v] + cy
        left, right = min(left, x[v]), max(right, x[v])
        top, bottom = min(top, y[v]), max(bottom, y[v])
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        if in_front or (q[i] > 0.0 and q[j] > 0.0 and q[k] > 0.0):
            draw_triangle(
                x[i], y[i], q[i], x[j], y[j], q[j], x[k], y[k], q[k], inverse_depth, nearest_face, f,
                both_sides,
            )  # fmt: skip
        elif q[i] > 0.0 or q[j] > 0.0 or q[k] > 0.0:
            corners, count = clip_to_near_plane(vertices[i], vertices[j], vertices[k])
            for n in range(count):
                corners[n, 2] = 1.0 / corners[n, 2]
                corners[n, 0] = fx * corners[n, 0] * corners[n, 2] + cx
                corners[n, 1] = fy * corners[n, 1] * corners[n, 2] + cy
            for n in range(2, count):
                a, b, c = corners[0], corners[n - 1], corners[n]
                draw_triangle(
                    a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2], inverse_depth, nearest_face,
                    f, both_sides,
                )  # fmt: skip
    if not in_front:  # what is clipped may reach anywhere
        return 0, height, 0, width
    return (*pixels_between(top, bottom, height), *pixels_between(left, right, width))


@njit(**EXACT)
def clip_to_near_plane(a, b, c):
    """The part of a triangle with z >= NEAR as the corners (4, 3) of a polygon, and their number (3 or 4)."""
    triangle = (a, b, c)
    corners = np.empty((4, 3))
    count = 0
    for k in range(3):
        here, there = triangle[k], triangle[(k + 1) % 3]
        if here[2] >= NEAR:
            corners[count] = here
            count += 1
        if (here[2] >= NEAR) != (there[2] >= NEAR):
            share = (NEAR - here[2]) / (there[2] - here[2])
            corners[count] = here + share * (there - here)
            corners[count, 2] = NEAR
            count += 1
    return corners, count


@njit(**EXACT)
def draw_triangle(xa, ya, qa, xb, yb, qb, xc, yc, qc, inverse_depth, nearest_face, f, both_sides):
    """Draw one triangle given by pixels (x, y) and inverse depths q, which are linear across the image.

    An edge function is positive on the inner side of its edge; it is computed once and then grows by the same
    from pixel to pixel. Rounding must not open a crack between two triangles that share an edge, so that a
    pixel counts as inside down to `slack`.
    """
    area = (xb - xa) * (yc - ya) - (xc - xa) * (yb - ya)
    if area > 0.0 and not both_sides:  # rows grow downwards: fronts have negative area
        return
    x_low, x_high, y_low, y_high = min(xa, xb, xc), max(xa, xb, xc), min(ya, yb, yc), max(ya, yb, yc)
    extent = (x_high - x_low) * (y_high - y_low)  # no product in an edge function is larger
    height, width = inverse_depth.shape
    left, right = pixels_between(x_low, x_high, width)
    top, bottom = pixels_between(y_low, y_high, height)
    if left >= right or top >= bottom or abs(area) <= 1e-9 * extent:
        return
    slack = -1e-12 * extent
    side = 1.0 if area > 0.0 else -1.0
    dxa, dxb, dxc = (yb - yc) * side, (yc - ya) * side, (ya - yb) * side
    dya, dyb, dyc = (xc - xb) * side, (xa - xc) * side, (xb - xa) * side
    wa = ((xb - left) * (yc - top) - (xc - left) * (yb - top)) * side
    wb = ((xc - left) * (ya - top) - (xa - left) * (yc - top)) * side
    wc = ((xa - left) * (yb - top) - (xb - left) * (ya - top)) * side
    per_area = 1.0 / abs(area)
    q = (wa * qa + wb * qb + wc * qc) * per_area
    dxq = (dxa * qa + dxb * qb + dxc * qc) * per_area
    dyq = (dya * qa + dyb * qb + dyc * qc) * per_area
    for j in range(bottom - top):
        va, vb, vc, vq = wa + j * dya, wb + j * dyb, wc + j * dyc, q + j * dyq
        nearest = inverse_depth[top + j, left:right]
        for i in range(len(nearest)):  # without branches, which a processor cannot foresee here
            inside = (va + i * dxa >= slack) & (vb + i * dxb >= slack) & (vc + i * dxc >= slack)
            shown = inside & (vq + i * dxq > nearest[i])
            nearest[i] = vq + i * dxq if shown else nearest[i]
            if nearest_face is not None:
                nearest_face[top + j, left + i] = f if shown else nearest_face[top + j, left + i]


@njit(**EXACT)
def pixels_between(low, high, size):
    """(first, end) of the pixels along an axis of the image that lie in [low, high]."""
    return int(np.ceil(min(max(low, 0.0), size))), int(np.floor(max(min(high, size - 1.0), -1.0))) + 1
