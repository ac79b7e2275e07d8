"""Placing an object: laws that hold for any pose, and what is seen of a table made for it."""

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from app.labeling.moves import placement
from registration_core import ObjectModel
from registration_core.geometry import pose
from tests.app.export.site import (
    BLOCK,
    CAMERA,
    NEAR_VIEW,
    T_WORLD_BLOCK,
    TOOL,
    mesh_of,
    model_of,
    observed_depth,
)

numbers = st.floats(-1.0, 1.0)
vectors = st.tuples(numbers, numbers, numbers).map(np.array)
poses = st.tuples(vectors, vectors).map(lambda parts: pose.exp(np.concatenate(parts)))
axes = vectors.map(lambda vector: pose.exp([0, 0, 0, *vector])[:3, :3])
STILL = np.zeros(3)
TABLE = np.array([0.0, 0.0, 1.0, 0.0])
SENSOR = NEAR_VIEW[:3, 3]
HALF_A_TENTH = 5e-5
"""Metres."""


@pytest.fixture(scope="module")
def block() -> ObjectModel:
    return model_of(mesh_of(BLOCK))


@pytest.fixture(scope="module")
def tool() -> ObjectModel:
    return model_of(mesh_of(TOOL))


@pytest.fixture(scope="module")
def seen() -> np.ndarray:
    """What the camera measured of the table and what is on it."""
    return placement.measured_points(observed_depth(NEAR_VIEW), CAMERA, NEAR_VIEW)


# -- nudges


@given(poses, axes, vectors, vectors, vectors)
def test_there_and_back_is_where_it_was(T, along, shift, turn, pivot):
    there = placement.nudged(T, along, shift, turn, pivot)
    assert placement.nudged(there, along, -shift, -turn, pivot) == pytest.approx(T, abs=1e-9)


@given(poses, axes, vectors, vectors)
def test_turning_leaves_the_pivot_where_it_is(T, along, turn, pivot):
    turned = placement.nudged(T, along, STILL, turn, pivot)
    assert pose.apply(turned, pivot) == pytest.approx(pose.apply(T, pivot), abs=1e-9)


@given(poses, axes, vectors, vectors)
def test_a_shift_goes_along_the_axes_and_turns_nothing(T, along, shift, pivot):
    moved = placement.nudged(T, along, shift, STILL, pivot)
    assert moved[:3, :3] == pytest.approx(T[:3, :3], abs=1e-12)
    assert along.T @ (moved[:3, 3] - T[:3, 3]) == pytest.approx(shift, abs=1e-9)


@given(poses, axes, vectors)
def test_four_quarters_and_two_halves_are_a_whole_turn(T, along, pivot):
    for quarters, count in ((1, 4), (2, 2)):
        turned = T
        for _ in range(count):
            turned = placement.nudged(turned, along, STILL, np.array([0, quarters * np.pi / 2, 0]), pivot)
        assert turned == pytest.approx(T, abs=1e-9)


@given(poses, vectors, vectors)
def test_in_its_own_axes_a_nudge_is_a_motion_of_the_object(T, shift, turn):
    moved = placement.nudged(T, T[:3, :3], shift, turn, STILL)
    assert moved == pytest.approx(T @ pose.exp([*shift, *turn]), abs=1e-9)


# -- putting down


@given(poses, vectors)
def test_a_rested_object_touches_the_plane_from_above(T, normal):
    plane = np.array([*pose.exp([0, 0, 0, *normal])[:3, 0], 0.3])
    vertices = mesh_of(TOOL).vertices
    rested = placement.rested(T, vertices, plane)
    heights = placement.height(pose.apply(rested, vertices), plane)
    assert heights.min() == pytest.approx(0.0, abs=1e-9)
    assert rested[:3, :3] == pytest.approx(T[:3, :3])
    assert np.cross(rested[:3, 3] - T[:3, 3], plane[:3]) == pytest.approx(0.0, abs=1e-9)


def test_a_rested_box_touches_a_measured_plane(block):
    grid = np.stack(np.meshgrid(np.linspace(-0.2, 0.2, 40), np.linspace(-0.2, 0.2, 40)), axis=-1).reshape(
        -1, 2
    )
    points = np.column_stack([grid, np.zeros(len(grid))])
    plane = placement.supporting_plane(points, np.array([0.0, -0.4, 0.3]))
    assert plane == pytest.approx(TABLE, abs=1e-6)
    rested = placement.rested(pose.exp([0.05, 0.02, 0.2, 0.4, 0.3, 0.2]), block.vertices, plane)
    assert pose.apply(rested, block.vertices)[:, 2].min() == pytest.approx(0.0, abs=HALF_A_TENTH)


def test_the_table_is_what_things_stand_on(seen):
    near = placement.nearby(seen, T_WORLD_BLOCK[:3, 3], radius=0.05)
    assert 0 < len(near) < len(seen)
    plane = placement.supporting_plane(near, SENSOR)
    assert plane == pytest.approx(TABLE, abs=0.003)


def test_the_large_top_of_a_box_is_not_what_it_stands_on():
    rng = np.random.default_rng(1)
    top = np.column_stack([rng.uniform(-0.1, 0.1, (3000, 2)), np.full(3000, 0.1)])
    table = np.column_stack([rng.uniform(0.1, 0.3, (1000, 2)), np.zeros(1000)])
    plane = placement.supporting_plane(np.concatenate([top, table]), np.array([0.0, -0.5, 0.5]))
    assert plane == pytest.approx(TABLE, abs=1e-6)


def test_where_nothing_is_flat_there_is_no_plane():
    rng = np.random.default_rng(2)
    assert placement.supporting_plane(rng.uniform(-1, 1, (2000, 3)), SENSOR) is None
    assert placement.supporting_plane(np.zeros((5, 3)), SENSOR) is None


# -- placing


def first_hit(model: ObjectModel, T: np.ndarray, eye: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Where the ray from the eye through a point meets the model first."""
    corners = pose.apply(T, model.vertices)[model.faces]
    ray = (point - eye) / np.linalg.norm(point - eye)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    faced = normals @ ray != 0  # the ray never meets a face that it runs along
    corners, normals = corners[faced], normals[faced]
    along = np.einsum("fi,fi->f", normals, corners[:, 0] - eye) / (normals @ ray)
    inside = np.all(
        [
            np.einsum(
                "fi,fi->f", np.cross(corners[:, (i + 1) % 3] - corners[:, i], at - corners[:, i]), normals
            )
            >= -1e-12
            for at in [eye + along[:, None] * ray]
            for i in range(3)
        ],
        axis=0,
    )
    return eye + along[inside].min() * ray


@given(poses, st.tuples(st.floats(0.1, 0.5), numbers, numbers).map(np.array))
def test_pointed_at_the_object_the_surface_meets_the_point(T, point):
    eye = np.array([-1.0, 0.2, 0.1])
    model = model_of(mesh_of(BLOCK))
    placed = placement.placed(T, model, point, eye, None)
    assert placed[:3, :3] == pytest.approx(T[:3, :3])
    assert first_hit(model, placed, eye, point) == pytest.approx(point, abs=1e-6)
    centre = pose.apply(placed, model.centre)
    assert np.cross(centre - eye, point - eye) == pytest.approx(0.0, abs=1e-6)


def test_pointed_at_the_table_the_object_stands_there(tool):
    point = np.array([0.2, 0.1, 0.001])
    T = pose.exp([0.4, 0.3, 0.7, 0.2, 0.9, -0.3])
    placed = placement.placed(T, tool, point, SENSOR, TABLE)
    assert placed[:3, :3] == pytest.approx(T[:3, :3])
    assert pose.apply(placed, tool.vertices)[:, 2].min() == pytest.approx(0.0, abs=1e-9)
    assert pose.apply(placed, tool.centre)[:2] == pytest.approx(point[:2])


def test_pointed_above_the_table_the_table_does_not_matter(block):
    point = np.array([-0.05, -0.03, 0.04])
    with_table = placement.placed(np.eye(4), block, point, SENSOR, TABLE)
    assert with_table == pytest.approx(placement.placed(np.eye(4), block, point, SENSOR, None))
    assert first_hit(block, with_table, SENSOR, point) == pytest.approx(point, abs=1e-6)


def test_through_the_hole_of_a_ring_its_first_vertex_counts():
    ring = model_of(trimesh.creation.annulus(r_min=0.05, r_max=0.06, height=0.02))
    placed = placement.placed(np.eye(4), ring, np.array([0.0, 0.0, 0.3]), np.array([0.0, 0.0, 1.0]), None)
    assert pose.apply(placed, ring.vertices)[:, 2].max() == pytest.approx(0.3)


def test_a_click_on_the_block_puts_it_nearly_where_it_is(block, seen):
    """From the true rotation, the click alone is off by no more than the pointer is."""
    centre = pose.apply(pose.inverse(NEAR_VIEW), T_WORLD_BLOCK[:3, 3])
    column = CAMERA.fx * centre[0] / centre[2] + CAMERA.cx
    row = CAMERA.fy * centre[1] / centre[2] + CAMERA.cy
    point = placement.point_at_pixel(observed_depth(NEAR_VIEW), CAMERA, NEAR_VIEW, column, row)
    assert point is not None
    plane = placement.supporting_plane(placement.nearby(seen, point, block.radius), SENSOR)
    away = T_WORLD_BLOCK.copy()
    away[:3, 3] += [0.2, -0.1, 0.3]
    placed = placement.placed(away, block, point, SENSOR, plane)
    assert placed[:3, 3] == pytest.approx(T_WORLD_BLOCK[:3, 3], abs=0.004)


# -- pointing


def test_a_pixel_points_at_what_was_measured_there():
    depth = np.full((CAMERA.height, CAMERA.width), 0.5, dtype=np.float32)
    depth[100, 50] = 0.0  # a hole
    depth[101, 50] = 3.0  # an outlier
    point = placement.point_at_pixel(depth, CAMERA, np.eye(4), 50.0, 100.0)
    expected = [0.5 * (50 - CAMERA.cx) / CAMERA.fx, 0.5 * (100 - CAMERA.cy) / CAMERA.fy, 0.5]
    assert point == pytest.approx(expected)
    assert placement.point_at_pixel(np.zeros_like(depth), CAMERA, np.eye(4), 50.0, 100.0) is None


@pytest.mark.parametrize("corner", [(0.0, 0.0), (CAMERA.width - 1.0, CAMERA.height - 1.0)])
def test_the_corners_of_an_image_can_be_pointed_at(corner):
    depth = np.full((CAMERA.height, CAMERA.width), 0.5, dtype=np.float32)
    assert placement.point_at_pixel(depth, CAMERA, np.eye(4), *corner) is not None


def test_a_ray_meets_the_first_point_under_it(seen):
    target = seen[len(seen) // 2]
    behind = np.concatenate([seen, [SENSOR + 2.0 * (target - SENSOR)], [SENSOR - (target - SENSOR)]])
    met = placement.point_along_ray(behind, SENSOR, target - SENSOR)
    assert met == pytest.approx(target, abs=0.01)


def test_a_ray_may_pass_between_the_points_of_a_coarse_cloud_but_not_by_it():
    points = np.array([[0.01, 0.0, 1.0], [0.5, 0.0, 1.0]])
    assert placement.point_along_ray(points, STILL, np.array([0.0, 0.0, 2.0])) == pytest.approx(points[0])
    assert placement.point_along_ray(points, STILL, np.array([0.0, 1.0, 0.0])) is None
    assert placement.point_along_ray(points[:0], STILL, np.array([0.0, 0.0, 1.0])) is None
