import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.distance import cdist

from registration_core.geometry import pose
from registration_core.geometry.camera import Intrinsics, project
from registration_core.geometry.object_model import ObjectModel
from registration_core.synthetic.objects import demo_objects, random_distractor
from registration_core.synthetic.tabletop import (
    Layout,
    are_apart,
    cameras_around,
    look_at,
    place,
    resting_rotation,
    stable_directions,
)

MODELS = [known.model for known in demo_objects()]


def model_of(mesh: trimesh.Trimesh) -> ObjectModel:
    return ObjectModel(np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int32))


def test_a_box_is_stable_on_its_six_sides_by_their_size():
    directions, weights = stable_directions(model_of(trimesh.creation.box((0.1, 0.2, 0.4))))
    chances = {
        tuple(np.eye(3)[axis]): weights[np.isclose(directions[:, axis], 1.0)].sum() for axis in range(3)
    }
    assert np.abs(directions).max(axis=1) == pytest.approx(1.0)
    # A side is weighed by its area over the square of its distance from the middle.
    shares = np.array([0.2 * 0.4 / 0.05**2, 0.1 * 0.4 / 0.1**2, 0.1 * 0.2 / 0.2**2])
    assert list(chances.values()) == pytest.approx(shares / (2 * shares.sum()))


def test_a_tall_slanted_prism_does_not_stand_on_its_foot():
    leaning = trimesh.creation.box((0.1, 0.1, 0.4))
    shear = np.eye(4)
    shear[0, 2] = 1.0
    leaning.apply_transform(shear)
    directions, _ = stable_directions(model_of(leaning))
    assert directions[:, 2].min() > -0.99


@pytest.mark.parametrize("seed", range(12))
def test_what_rests_stays_when_it_is_nudged(seed):
    # The centre of mass of the hull lies above the convex outline of the points that touch the table.
    rng = np.random.default_rng(seed)
    model = MODELS[seed % 5]
    vertices = model.vertices @ resting_rotation(model, rng, upright=0.0).T
    hull = trimesh.convex.convex_hull(vertices)
    low = hull.vertices[hull.vertices[:, 2] < hull.vertices[:, 2].min() + 1e-6]
    foot = ConvexHull(low[:, :2])
    distances = foot.equations[:, :2] @ hull.center_mass[:2] + foot.equations[:, 2]
    assert distances.max() < 1e-6


squares = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0, 3)).map(
    lambda p: (
        np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        * 0.3
        @ np.array([[np.cos(p[2]), np.sin(p[2])], [-np.sin(p[2]), np.cos(p[2])]])
        + p[:2]
    )
)


@given(squares, squares)
def test_polygons_are_apart_exactly_where_a_gap_is(a, b):
    def outline(square: np.ndarray) -> np.ndarray:
        share = np.linspace(0, 1, 60, endpoint=False)[:, None, None]
        return ((1 - share) * square + share * np.roll(square, -1, axis=0)).reshape(-1, 2)

    nearest = cdist(outline(a), outline(b)).min()
    assert are_apart(a, b, 0.0) == are_apart(b, a, 0.0)
    if are_apart(a, b, 0.05):
        assert nearest >= 0.05 - 1e-9
    if nearest < 0.05:
        assert not are_apart(a, b, 0.08)


@pytest.mark.parametrize("seed", range(6))
def test_things_touch_the_table_and_nothing_else(seed):
    rng = np.random.default_rng(seed)
    models = [*MODELS, *(random_distractor(rng).model for _ in range(4))]
    placed = place(models, rng, Layout(upright=0.3))
    surfaces = [pose.apply(thing.T_world_object, thing.model.vertices) for thing in placed]
    assert [thing.model for thing in placed] == models
    for k, points in enumerate(surfaces):
        assert points[:, 2].min() == pytest.approx(0.0, abs=1e-9)
        for other in surfaces[:k]:
            assert cdist(points[::7], other[::7]).min() >= 0.006 - 1e-9


def test_a_camera_looks_at_its_target():
    camera = Intrinsics(width=640, height=480, fx=570, fy=570, cx=319.5, cy=239.5)
    T_world_camera = look_at(np.array([0.5, -0.6, 0.4]), np.array([0.1, 0.0, 0.05]))
    in_camera = pose.apply(pose.inverse(T_world_camera), [[0.1, 0.0, 0.05], [0.1, 0.0, 0.15]])
    middle, above = project(in_camera, camera)
    assert middle == pytest.approx([319.5, 239.5])
    assert above[1] < middle[1]
    assert above[0] == pytest.approx(middle[0])


def test_cameras_stand_around_the_table_as_asked():
    layout = Layout(elevation=(0.3, 0.4), distance=(0.5, 0.6))
    for T_world_camera in cameras_around(7, np.random.default_rng(0), layout):
        pose.checked(T_world_camera, "T_world_camera")
        from_target = T_world_camera[:3, 3] - [0, 0, 0.05]
        assert 0.46 < np.linalg.norm(from_target) < 0.64
        assert 0.25 < np.arcsin(from_target[2] / np.linalg.norm(from_target)) < 0.45
