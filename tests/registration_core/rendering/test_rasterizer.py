"""The z-buffer against Open3D's ray caster, and against what geometry says."""

from pathlib import Path
from typing import Any

import numpy as np
import open3d
import pytest
import trimesh
from numpy.typing import NDArray

from registration_core import Intrinsics, ObjectModel
from registration_core.geometry import pose
from registration_core.rendering.rasterizer import draw_mesh, pixels_between, render_depth

CAMERA = Intrinsics(320, 240, 300.0, 310.0, 155.2, 121.7)


def ray_cast(model: ObjectModel, camera: Intrinsics, T: NDArray[np.float64]) -> NDArray[np.float32]:
    """The same image by Open3D: z of the first hit of the ray through each pixel's centre."""
    scene: Any = open3d.t.geometry.RaycastingScene()
    tensor: Any = open3d.core.Tensor
    scene.add_triangles(
        pose.apply(T, model.vertices).astype(np.float32), np.asarray(model.faces, dtype=np.uint32)
    )
    columns, rows = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    directions = np.stack(
        [(columns - camera.cx) / camera.fx, (rows - camera.cy) / camera.fy, np.ones(columns.shape)], axis=-1
    )
    rays = np.concatenate([np.zeros_like(directions), directions], axis=-1).astype(np.float32)
    z = scene.cast_rays(tensor(rays))["t_hit"].numpy()
    return np.where(np.isfinite(z), z, 0)


def model_of(mesh: trimesh.Trimesh) -> ObjectModel:
    return ObjectModel(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int32))


def assert_equal_images(drawn: NDArray[np.float32], cast: NDArray[np.float32]) -> None:
    """Equal to rounding; a ray through an edge may fall on either side of it."""
    assert (drawn > 0).sum() > 100
    assert ((drawn > 0) != (cast > 0)).sum() <= 3
    both = (drawn > 0) & (cast > 0)
    apart = np.abs(drawn - cast)[both]
    assert (apart > 1e-5).sum() <= 3
    assert np.median(apart) < 1e-6


@pytest.mark.parametrize("centre", [(0.0, 0.0, 0.5), (0.25, -0.15, 0.5), (0.01, 0.0, 0.12)])
@pytest.mark.parametrize("mesh", ["bunny/models/obj_000001.ply", "ycbv/models/obj_000014.ply"])
def test_equals_ray_casting_on_real_meshes(
    shared_data: Path, mesh: str, centre: tuple[float, float, float]
) -> None:
    model = ObjectModel.load(shared_data / mesh, unit="mm")
    T = pose.exp([*centre, 1.0, 0.4, -2.0])
    T[:3, 3] -= T[:3, :3] @ model.centre
    assert_equal_images(render_depth(model, CAMERA, T), ray_cast(model, CAMERA, T))


def test_open_surface_is_drawn_from_both_sides() -> None:
    cup = trimesh.creation.cylinder(radius=0.05, height=0.1, sections=40)
    keep = cup.face_normals[:, 2] < 0.9
    model = ObjectModel(np.asarray(cup.vertices), np.asarray(cup.faces[keep], dtype=np.int32))
    T = pose.exp([0.0, 0.0, 0.4, np.pi + 0.5, 0.0, 0.0])
    drawn = render_depth(model, CAMERA, T)
    assert_equal_images(drawn, ray_cast(model, CAMERA, T))
    flipped = ObjectModel(model.vertices, model.faces[:, ::-1].copy())
    np.testing.assert_allclose(render_depth(flipped, CAMERA, T), drawn, atol=1e-6)


def test_fronto_parallel_square_covers_the_pixels_whose_centres_it_holds() -> None:
    camera = Intrinsics(20, 20, 10.0, 10.0, 10.0, 10.0)
    square = np.array([[-0.25, -0.25, 0], [0.25, -0.25, 0], [0.25, 0.25, 0], [-0.25, 0.25, 0]])
    model = ObjectModel(square, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32))
    depth = render_depth(model, camera, pose.exp([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]))
    expected = np.zeros((20, 20), dtype=np.float32)
    expected[8:13, 8:13] = 1.0  # from -2.5 to 2.5 pixels about pixel (10, 10)
    np.testing.assert_allclose(depth, expected, atol=1e-7)


def test_floor_under_the_camera_is_clipped_at_the_near_plane() -> None:
    half = 50.0
    corners = np.array([[-half, 0, -half], [half, 0, -half], [half, 0, half], [-half, 0, half]])
    model = ObjectModel(corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32))
    depth = render_depth(model, CAMERA, pose.exp([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]))
    rows = np.arange(CAMERA.height)
    below = rows > CAMERA.cy + 10
    expected = CAMERA.fy / (rows[below] - CAMERA.cy)  # z of the ray at y = 1
    np.testing.assert_allclose(depth[below], np.repeat(expected[:, None], CAMERA.width, 1), rtol=1e-5)
    assert not depth[rows < CAMERA.cy].any()


def test_nothing_behind_the_camera_is_drawn() -> None:
    model = model_of(trimesh.creation.box((0.1, 0.1, 0.1)))
    assert not render_depth(model, CAMERA, pose.exp([0.0, 0.0, -0.5, 0.0, 0.0, 0.0])).any()


def drawn(vertices: NDArray[np.float64], faces: NDArray[np.int32], both_sides: bool):
    """Inverse depth, nearest face (H, W) and the part of the image that was drawn on."""
    inverse_depth = np.zeros((CAMERA.height, CAMERA.width), np.float32)
    nearest_face = np.full(inverse_depth.shape, -1, np.int32)
    part = draw_mesh(
        vertices, faces, CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy, inverse_depth, nearest_face, both_sides
    )
    return inverse_depth, nearest_face, part


@pytest.mark.parametrize("centre", [(0.0, 0.0, 0.5), (-0.26, 0.2, 0.5), (0.3, -0.2, 0.5), (2.0, 0.0, 0.5)])
def test_everything_drawn_lies_in_the_part_that_is_told(centre: tuple[float, float, float]) -> None:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.05)
    inverse_depth, nearest_face, (top, bottom, left, right) = drawn(
        np.asarray(ball.vertices) + centre, np.asarray(ball.faces, dtype=np.int32), True
    )
    rows, columns = np.nonzero(inverse_depth)
    if centre[0] > 1.0:
        assert len(rows) == 0
        assert left >= right or top >= bottom
        return
    assert top <= rows.min() <= rows.max() < bottom
    assert left <= columns.min() <= columns.max() < right
    if centre == (0.0, 0.0, 0.5):  # not cut by the border
        assert (bottom - top) * (right - left) == (np.ptp(rows) + 1) * (np.ptp(columns) + 1)
    np.testing.assert_array_equal(nearest_face >= 0, inverse_depth > 0)


def test_front_sides_of_a_closed_mesh_show_all_of_it() -> None:
    mesh = trimesh.creation.torus(major_radius=0.06, minor_radius=0.02)
    vertices = pose.apply(pose.exp([0.05, -0.02, 0.4, 1.0, 0.4, -2.0]), np.asarray(mesh.vertices))
    faces = np.asarray(mesh.faces, dtype=np.int32)
    both, face_of_both, _ = drawn(vertices, faces, True)
    front, face_of_front, _ = drawn(vertices, faces, False)
    assert (both > 0).sum() > 1000
    np.testing.assert_array_equal(front, both)
    np.testing.assert_array_equal(face_of_front, face_of_both)
    inside_out, _, _ = drawn(vertices, faces[:, ::-1].copy(), False)
    assert (inside_out < both).sum() > 1000  # what is left is the far side


@pytest.mark.parametrize(
    "sides", [((1, 0), (0, 1)), ((5, 2), (-3, 4)), ((20, 8), (-12, 16)), ((0.3, 1), (-1, 0.3))]
)
def test_no_crack_opens_between_triangles(sides: tuple[tuple[float, float], tuple[float, float]]) -> None:
    # a grid of 8 x 8 parallelograms, with edges on the centres of pixels but for the rounding
    basis, middle = np.array(sides), np.array([155.0, 122.0])
    x, y = np.meshgrid(np.arange(-4, 5), np.arange(-4, 5))
    pixels = np.stack([x, y], axis=-1).reshape(-1, 2) @ basis + middle
    rays = (pixels - [CAMERA.cx, CAMERA.cy]) / [CAMERA.fx, CAMERA.fy]
    corners = (np.arange(8)[:, None] * 9 + np.arange(8)).reshape(-1, 1)
    faces = np.concatenate([corners + np.array([0, 1, 10]), corners + np.array([0, 10, 9])])
    columns, rows = np.meshgrid(np.arange(CAMERA.width), np.arange(CAMERA.height))
    steps = (np.stack([columns, rows], axis=-1) - middle) @ np.linalg.inv(basis)
    reach = np.abs(steps).max(axis=-1)
    assert (reach < 4 - 1e-6).sum() > 40
    for z in np.linspace(0.5, 1.5, 40):
        vertices = np.column_stack([rays, np.ones(len(rays))]) * z
        inverse_depth, _, _ = drawn(vertices, faces.astype(np.int32), True)
        np.testing.assert_allclose(inverse_depth[reach < 4 - 1e-6], 1 / z, rtol=1e-6)
        assert not inverse_depth[reach > 4 + 1e-6].any()


def test_triangle_seen_edge_on_shows_nothing() -> None:
    corners = np.array([[-0.1, 0.0, 0.5], [0.1, 0.0, 0.5], [0.3, 0.0, 1.0]])  # in a plane through the camera
    inverse_depth, _, _ = drawn(corners, np.array([[0, 1, 2]], dtype=np.int32), True)
    assert not inverse_depth.any()


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [(1.2, 3.9, (2, 4)), (2.0, 3.0, (2, 4)), (-5.0, -1.0, (0, 0)), (-5.0, 99.0, (0, 10)), (2.1, 2.9, (3, 3))],
)
def test_pixels_between_two_places(low: float, high: float, expected: tuple[int, int]) -> None:
    assert pixels_between(low, high, 10) == expected


@pytest.mark.parametrize("low", [10.5, 1e12, np.inf])
def test_no_pixel_lies_beyond_the_image(low: float) -> None:
    first, end = pixels_between(low, low + 1.0, 10)
    assert first >= end
