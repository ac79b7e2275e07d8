# mypy: allow-untyped-defs
"""Depth images of a mesh by a z-buffer on the CPU: exact, without OpenGL, fast for small images and
meshes.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from registration_core import pose
from registration_core.camera import Intrinsics
from registration_core.kernels import EXACT
from registration_core.object_model import ObjectModel

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
        nearest_face: (H, W) int32, set to the index of the face that is seen, or None.
        both_sides: False for a closed mesh wound counter-clockwise seen from outside, of which only front
            sides can be seen: half of the work.
    """
    pixels = np.empty((vertices.shape[0], 3))
    for v in range(vertices.shape[0]):
        z = vertices[v, 2]
        q = 1.0 / z if z >= NEAR else 0.0
        pixels[v, 0] = fx * vertices[v, 0] * q + cx
        pixels[v, 1] = fy * vertices[v, 1] * q + cy
        pixels[v, 2] = q
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        a, b, c = pixels[i], pixels[j], pixels[k]
        if a[2] > 0.0 and b[2] > 0.0 and c[2] > 0.0:
            draw_triangle(
                a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2], inverse_depth, nearest_face, f,
                both_sides,
            )  # fmt: skip
        elif a[2] > 0.0 or b[2] > 0.0 or c[2] > 0.0:
            corners, count = clip_to_near_plane(vertices[i], vertices[j], vertices[k])
            for n in range(count):
                q = 1.0 / corners[n, 2]
                corners[n, 0] = fx * corners[n, 0] * q + cx
                corners[n, 1] = fy * corners[n, 1] * q + cy
                corners[n, 2] = q
            for n in range(2, count):
                a, b, c = corners[0], corners[n - 1], corners[n]
                draw_triangle(
                    a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2], inverse_depth, nearest_face,
                    f, both_sides,
                )  # fmt: skip


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

    An edge shared by two triangles gives the same numbers in both, so that no crack opens between them.
    """
    area = (xb - xa) * (yc - ya) - (xc - xa) * (yb - ya)
    if area == 0.0 or (area > 0.0 and not both_sides):  # rows grow downwards: fronts have negative area
        return
    side = 1.0 if area > 0.0 else -1.0
    height, width = inverse_depth.shape
    left = int(np.ceil(max(0.0, min(xa, xb, xc))))
    right = int(np.floor(min(width - 1.0, max(xa, xb, xc))))
    top = int(np.ceil(max(0.0, min(ya, yb, yc))))
    bottom = int(np.floor(min(height - 1.0, max(ya, yb, yc))))
    for y in range(top, bottom + 1):
        for x in range(left, right + 1):
            wa = (xb - x) * (yc - y) - (xc - x) * (yb - y)
            wb = (xc - x) * (ya - y) - (xa - x) * (yc - y)
            wc = (xa - x) * (yb - y) - (xb - x) * (ya - y)
            if wa * side >= 0.0 and wb * side >= 0.0 and wc * side >= 0.0:
                q = (wa * qa + wb * qb + wc * qc) / area
                if q > inverse_depth[y, x]:
                    inverse_depth[y, x] = q
                    if nearest_face is not None:
                        nearest_face[y, x] = f
