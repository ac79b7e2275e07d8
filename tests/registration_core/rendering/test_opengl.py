import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import open3d as o3d
import pytest
import trimesh

from registration_core.geometry import pose
from registration_core.geometry.camera import Intrinsics, project
from registration_core.geometry.mesh_reduction import is_closed, merged
from registration_core.geometry.object_model import ObjectModel
from registration_core.rendering.opengl import Light, Renderer, Surroundings, looking_along
from registration_core.rendering.rasterizer import draw_mesh, render_depth

CAMERA = Intrinsics(width=320, height=240, fx=300.0, fy=310.0, cx=150.3, cy=125.7)
ROUNDING = 2e-5
"""Metres: what a 24-bit depth buffer with a near plane at 1 cm leaves at half a metre, generously."""


@pytest.fixture(scope="module")
def renderer():
    with Renderer(CAMERA) as opened:
        yield opened


def cast_depth(model: ObjectModel, T_camera_object: np.ndarray) -> np.ndarray:
    """Depth (H, W) by Open3D's ray casting, an independent answer."""
    scene: Any = o3d.t.geometry.RaycastingScene()
    tensor: Any = o3d.core.Tensor
    vertices = pose.apply(T_camera_object, model.vertices).astype(np.float32)
    scene.add_triangles(vertices, model.faces.astype(np.uint32))
    columns, rows = np.meshgrid(np.arange(CAMERA.width), np.arange(CAMERA.height))
    x, y = (columns - CAMERA.cx) / CAMERA.fx, (rows - CAMERA.cy) / CAMERA.fy
    rays = np.stack([*np.zeros((3, *x.shape)), x, y, np.ones_like(x)], axis=-1).astype(np.float32)
    depth = scene.cast_rays(tensor(rays))["t_hit"].numpy()  # rays have z = 1, so t is the depth
    return np.where(np.isfinite(depth), depth, 0.0)


def depth_as_the_likelihood_draws_it(model: ObjectModel, T_camera_object: np.ndarray) -> np.ndarray:
    """Depth (H, W) the way the particle filter draws: in float32, of a closed mesh the front sides alone."""
    vertices, faces = merged(model.vertices.astype(np.float32), model.faces)
    inverse_depth = np.zeros((CAMERA.height, CAMERA.width), np.float32)
    draw_mesh(
        pose.apply(T_camera_object, vertices), faces, CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy,
        inverse_depth, None, not is_closed(vertices, faces),
    )  # fmt: skip
    return np.divide(1.0, inverse_depth, out=np.zeros_like(inverse_depth), where=inverse_depth > 0)


def pixels_that_differ(a: np.ndarray, b: np.ndarray) -> int:
    """Pixels of two depth images that differ by more than rounding, in depth or in what covers them."""
    assert (a > 0).sum() > 250
    return int((np.abs(a - b) > ROUNDING).sum())


POSES = {
    "in the middle": pose.exp([0.0, 0.0, 0.5, 0.4, 0.5, 1.0]),
    "cut by the left and top border": pose.exp([-0.24, -0.19, 0.5, 1.4, -0.5, 1.0]),
    "cut by the right and bottom border": pose.exp([0.27, 0.18, 0.5, -0.4, 2.5, 0.3]),
}
CLOSED = [f"ycbv/models/obj_{number:06d}.ply" for number in (14, 15, 17)]
OPEN = ["ycbv/models/obj_000018.ply", "bunny/models/obj_000001.ply"]


@pytest.mark.parametrize("mesh", CLOSED + OPEN)
@pytest.mark.parametrize("place", POSES)
def test_three_renderers_agree_on_real_meshes(renderer, shared_data, mesh, place):
    model = ObjectModel.load(shared_data / mesh, "mm")
    T_camera_object = POSES[place] @ pose.from_rotation_translation(np.eye(3), -model.centre)
    drawn = renderer.depth([(model, T_camera_object)])
    rasterised = render_depth(model, CAMERA, T_camera_object)
    cast = cast_depth(model, T_camera_object)
    weighed = depth_as_the_likelihood_draws_it(model, T_camera_object)
    for other in (rasterised, weighed, cast):
        assert pixels_that_differ(drawn, other) <= 3  # whose centres lie on an edge


@pytest.mark.parametrize("mesh", CLOSED + OPEN)
def test_only_closed_meshes_are_drawn_from_one_side(shared_data, mesh):
    model = ObjectModel.load(shared_data / mesh, "mm")
    assert is_closed(*merged(model.vertices.astype(np.float32), model.faces)) == (mesh in CLOSED)


def test_depth_of_a_plane_is_known(renderer):
    # The plane z = 1 + 0.3 x is seen at depth 1 / (1 - 0.3 (u - cx) / fx).
    corners = np.array([[x, y, 1.0 + 0.3 * x] for x in (-2.0, 2.0) for y in (-2.0, 2.0)])
    plane = trimesh.Trimesh(corners, [[0, 1, 2], [2, 1, 3]], process=False)
    columns = np.arange(CAMERA.width)
    expected = 1.0 / (1.0 - 0.3 * (columns - CAMERA.cx) / CAMERA.fx)
    assert np.abs(renderer.depth([(plane, np.eye(4))]) - expected).max() < 5e-5


def test_the_nearest_of_several_meshes_is_seen(renderer):
    ball = trimesh.creation.icosphere(radius=0.05)
    near, far = (pose.from_rotation_translation(np.eye(3), [0, 0, z]) for z in (0.5, 1.0))
    alone = renderer.depth([(ball, near)])
    both = renderer.depth([(ball, far), (ball, near)])
    assert np.array_equal(both[alone > 0], alone[alone > 0])


def test_an_empty_scene_has_no_depth_and_only_background(renderer):
    assert not renderer.depth([]).any()
    color = renderer.color([], surroundings=Surroundings(background=(1.0, 0.0, 0.0)))
    assert np.array_equal(color, np.full((240, 320, 3), (255, 0, 0)))


def colored(mesh: trimesh.Trimesh, color: tuple[int, int, int]) -> trimesh.Trimesh:
    mesh.visual.vertex_colors = [*color, 255]
    return mesh


def test_colour_lies_where_depth_is(renderer):
    ball = colored(trimesh.creation.icosphere(subdivisions=4, radius=0.04), (220, 30, 30))
    T = pose.from_rotation_translation(np.eye(3), [0.05, -0.03, 0.5])
    white = Surroundings(background=(1.0, 1.0, 1.0))
    red = renderer.color([(ball, T)], surroundings=white).astype(int)
    mask = (red[..., 0] - red[..., 1]) > 60
    depth = renderer.depth([(ball, T)]) > 0
    assert (mask != depth).sum() < 0.05 * depth.sum()  # the rim is antialiased
    column, row = project(T[:3, 3], CAMERA)
    rows, columns = np.nonzero(mask)
    assert (columns.mean(), rows.mean()) == pytest.approx((column, row), abs=0.5)


def test_light_comes_from_where_it_is_put(renderer):
    ball = colored(trimesh.creation.icosphere(subdivisions=4, radius=0.06), (200, 200, 200))
    T = pose.from_rotation_translation(np.eye(3), [0, 0, 0.5])
    picture = renderer.color([(ball, T)], lights=[Light((1.0, 0.0, 0.3))]).astype(int)  # from the left
    row, column = round(CAMERA.cy), round(CAMERA.cx)
    assert picture[row, column - 25, 0] > picture[row, column + 25, 0] + 40


@pytest.mark.parametrize("direction", [(0, 0, 1), (0, -1, 0), (1, 2, 3)])
def test_lamps_look_along_their_direction(direction):
    T = looking_along(np.array(direction, dtype=float))
    assert -T[:3, 2] == pytest.approx(np.array(direction) / np.linalg.norm(direction))
    pose.checked(T, "lamp")


def run(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    root = Path(__file__).resolve().parents[3]
    return subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **environment},
        cwd=root,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow
def test_without_a_graphics_driver_the_error_says_what_to_install():
    code = (
        "from registration_core.geometry.camera import Intrinsics\n"
        "from registration_core.rendering.opengl import Renderer, RenderingError\n"
        "try: Renderer(Intrinsics(8, 8, 8, 8, 4, 4))\n"
        "except RenderingError as error: print(error)"
    )
    done = run(code, __EGL_VENDOR_LIBRARY_DIRS="/nonexistent", PYOPENGL_PLATFORM="egl")
    assert "apt-get install libegl1" in done.stdout, done.stderr


@pytest.mark.slow
def test_importing_the_module_does_not_load_opengl():
    code = (
        "import sys, registration_core.rendering.opengl; print(len({'pyrender', 'OpenGL'} & {*sys.modules}))"
    )
    assert run(code).stdout.split() == ["0"]
