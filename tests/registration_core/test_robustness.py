"""A snap with its default configuration on bad depth, odd meshes, other sizes and cut or hidden objects."""

from collections.abc import Callable

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from registration_core import Intrinsics, ObjectModel, snap
from registration_core.geometry import pose, pose_error
from registration_core.rendering.rasterizer import render_depth
from registration_core.synthetic.objects import demo_objects
from registration_core.synthetic.scene import table_model
from registration_core.synthetic.sensor_families import DEMO, draw_sensor
from registration_core.synthetic.sensors import at_edges, measure
from tests.registration_core.simple_scene import SimpleScene, nearest, noisy, tool

VGA = Intrinsics(640, 480, 525.0, 525.0, 319.5, 239.5)
HD = Intrinsics(1280, 720, 930.0, 930.0, 639.5, 359.5)

Depth = NDArray[np.float32]
Pose = NDArray[np.float64]


def on_table(model: ObjectModel, camera: Intrinsics = VGA, centre: tuple[float, float, float] = (0, 0, 0.75)):
    """The object upright on a table, its centre at a place in camera axes, seen obliquely from above."""
    R_camera_table = (
        pose.exp([0, 0, 0, np.radians(-125.0), 0, 0])[:3, :3] @ pose.exp([0, 0, 0, 0, 0, 0.6])[:3, :3]
    )
    truth = pose.from_rotation_translation(R_camera_table, np.array(centre) - R_camera_table @ model.centre)
    foot = np.append(model.centre[:2], model.vertices[:, 2].min())
    T_camera_table = pose.from_rotation_translation(R_camera_table, pose.apply(truth, foot))
    table = ObjectModel(*scaled_by(table_model(), max(1.0, centre[2])))
    depth = nearest(render_depth(table, camera, T_camera_table), render_depth(model, camera, truth))
    return SimpleScene(model, noisy(depth), camera, truth)


def scaled_by(model: ObjectModel, factor: float) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """The arrays of a larger or smaller mesh."""
    return model.vertices * factor, model.faces


def started(scene: SimpleScene, seed: int, metres: float = 0.02, degrees: float = 15.0) -> Pose:
    """A pose off the truth, turned about the object's centre."""
    T = pose.perturbed(scene.truth, metres, np.radians(degrees), np.random.default_rng(seed))
    T[:3, 3] += (scene.truth[:3, :3] - T[:3, :3]) @ scene.model.centre
    return T


def error(scene: SimpleScene, T: Pose) -> float:
    """MSSD over the diameter."""
    model = scene.model
    points = model.vertices[:: max(1, len(model.vertices) // 5000)]
    return pose_error.mssd(T, scene.truth, points, model.symmetry_transforms) / model.diameter


def errors(scene: SimpleScene, seeds: range = range(3), metres: float = 0.02) -> list[float]:
    """Of a snap from each of several starts."""
    found = []
    for seed in seeds:
        start = started(scene, seed, metres)
        assert error(scene, start) > 0.05
        estimate = snap(scene.model, scene.depth, scene.camera, start, rng=np.random.default_rng(seed))
        found.append(error(scene, estimate.T_camera_object))
    return found


@pytest.fixture(scope="module")
def scene() -> SimpleScene:
    return on_table(tool())


def seen_through(scene: SimpleScene, depth: Depth) -> SimpleScene:
    return SimpleScene(scene.model, depth, scene.camera, scene.truth)


def dropout(share: float) -> Callable[[SimpleScene, np.random.Generator], Depth]:
    return lambda scene, rng: np.where(rng.random(scene.depth.shape) < share, np.float32(0), scene.depth)


def blocks(scene: SimpleScene, rng: np.random.Generator) -> Depth:
    """A third of all blocks of 16 x 16 pixels missing."""
    lost = rng.random((scene.camera.height // 16, scene.camera.width // 16)) < 0.33
    return np.where(np.kron(lost, np.ones((16, 16), bool)), np.float32(0), scene.depth)


def flying(scene: SimpleScene, rng: np.random.Generator) -> Depth:
    """Pixels at edges hang anywhere between the two surfaces."""
    background = np.float32(np.median(scene.depth[scene.depth > 0]))
    mixed = scene.depth + rng.random(scene.depth.shape, np.float32) * (background - scene.depth)
    return np.where(at_edges(scene.depth, 0.02), mixed, scene.depth)


def structured_light(scene: SimpleScene, rng: np.random.Generator) -> Depth:
    return measure(scene.depth, scene.camera, rng, draw_sensor(DEMO, rng))


def no_background(scene: SimpleScene, rng: np.random.Generator) -> Depth:
    """Masked to the object."""
    return np.where(render_depth(scene.model, scene.camera, scene.truth) > 0, scene.depth, np.float32(0))


DAMAGES = [dropout(0.3), dropout(0.7), blocks, flying, structured_light, no_background]
NAMES = ["30 % lost", "70 % lost", "blocks lost", "flying pixels", "structured light", "masked"]


@pytest.mark.parametrize("damage", DAMAGES, ids=NAMES)
def test_bad_depth_still_leads_to_the_pose(scene, damage) -> None:
    damaged = seen_through(scene, damage(scene, np.random.default_rng(0)).astype(np.float32))
    assert max(errors(damaged)) < 0.05


@pytest.mark.parametrize("damage", DAMAGES, ids=NAMES)
def test_bad_depth_leaves_a_good_start_good(scene, damage) -> None:
    damaged = seen_through(scene, damage(scene, np.random.default_rng(1)).astype(np.float32))
    for seed in range(2):
        start = started(scene, seed, 0.001, 1.0)
        estimate = snap(scene.model, damaged.depth, scene.camera, start, rng=np.random.default_rng(seed))
        assert error(scene, estimate.T_camera_object) < 0.03


@pytest.mark.parametrize("bias", [-0.005, 0.005])
def test_biased_depth_shifts_the_pose_and_no_more(scene, bias) -> None:
    biased = seen_through(scene, np.where(scene.depth > 0, scene.depth + np.float32(bias), 0))
    expected = scene.truth.copy()
    expected[:3, 3] *= 1.0 + bias / expected[2, 3]  # along the ray
    shifted = SimpleScene(scene.model, biased.depth, scene.camera, expected)
    assert max(errors(shifted)) < 0.04


@pytest.mark.parametrize("camera", [VGA, HD], ids=["640x480", "1280x720"])
@pytest.mark.parametrize("known", demo_objects(), ids=lambda known: known.name)
def test_any_resolution_will_do(known, camera) -> None:
    assert np.median(errors(on_table(known.model, camera))) < 0.05


def subdivided(times: int) -> Callable[[ObjectModel], ObjectModel]:
    def change(model: ObjectModel) -> ObjectModel:
        vertices, faces = model.vertices, model.faces
        for _ in range(times):
            vertices, faces = trimesh.remesh.subdivide(vertices, faces)
        return ObjectModel(vertices, np.asarray(faces, dtype=np.int32), model.symmetries)

    return change


def a_million(model: ObjectModel) -> ObjectModel:
    """1.4 million faces: the first of the tool's boxes is subdivided once more than the others."""
    vertices, faces = trimesh.remesh.subdivide(model.vertices, model.faces, face_index=np.arange(12))
    model = subdivided(7)(ObjectModel(vertices, np.asarray(faces, dtype=np.int32)))
    assert len(model.faces) > 1_000_000
    return model


def with_faces(
    change: Callable[[NDArray[np.int32]], NDArray[np.int32]],
) -> Callable[[ObjectModel], ObjectModel]:
    """The mesh, of 3,000 faces, with other faces."""

    def changed(model: ObjectModel) -> ObjectModel:
        model = subdivided(3)(model)
        return ObjectModel(model.vertices, np.ascontiguousarray(change(model.faces), dtype=np.int32))

    return changed


def some(faces: NDArray[np.int32], share: float) -> NDArray[np.bool_]:
    return np.random.default_rng(0).random(len(faces)) < share


def flipped(faces: NDArray[np.int32]) -> NDArray[np.int32]:
    return np.where(some(faces, 0.3)[:, None], faces[:, ::-1], faces)


def with_fins(faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """Edges with three and more faces: some faces twice, and some across the inside."""
    across = np.column_stack([faces[::40, 0], faces[::40, 1], np.roll(faces[::40, 2], 1)])
    return np.concatenate([faces, faces[some(faces, 0.2)], across])


def bottomless(model: ObjectModel) -> ObjectModel:
    mesh = trimesh.Trimesh(model.vertices, model.faces, process=False)
    keep = ~((mesh.face_normals[:, 2] < -0.9) & (mesh.triangles_center[:, 2] < mesh.bounds[0, 2] + 1e-6))
    return ObjectModel(model.vertices, model.faces[keep])


def torn(model: ObjectModel) -> ObjectModel:
    """Three vertices of its own for every triangle."""
    faces = np.arange(model.faces.size, dtype=np.int32).reshape(-1, 3)
    return ObjectModel(model.vertices[model.faces].reshape(-1, 3), faces)


MESHES = {
    "48 faces": subdivided(0),
    "12,000 faces": subdivided(4),
    "1,400,000 faces": a_million,
    "open": bottomless,
    "pierced": with_faces(lambda faces: faces[~some(faces, 0.05)]),
    "flipped": with_faces(flipped),
    "inside out": with_faces(lambda faces: faces[:, ::-1]),
    "non-manifold": with_faces(with_fins),
    "torn": torn,
}


@pytest.mark.parametrize("change", MESHES.values(), ids=MESHES)
def test_any_mesh_will_do(scene, change) -> None:
    model = change(scene.model)
    assert max(errors(SimpleScene(model, scene.depth, scene.camera, scene.truth))) < 0.05


@pytest.mark.parametrize(("diameter", "distance"), [(0.02, 0.3), (0.05, 0.4), (0.4, 1.0), (1.0, 2.0)])
def test_objects_of_any_size_are_found(diameter, distance) -> None:
    model = ObjectModel(*scaled_by(tool(), diameter / tool().diameter))
    scene = on_table(model, centre=(0.0, 0.0, distance))
    assert max(errors(scene, metres=min(0.02, 0.15 * diameter))) < 0.06


BORDERS = {"left": (-0.45, 0.0), "right": (0.45, 0.0), "top": (0.0, -0.34), "bottom": (0.0, 0.34)}


@pytest.mark.parametrize("place", BORDERS.values(), ids=BORDERS)
def test_object_cut_by_the_border_is_found(place) -> None:
    scene = on_table(tool(), centre=(*place, 0.75))
    inside = (render_depth(scene.model, VGA, scene.truth) > 0).sum()
    whole = (render_depth(scene.model, VGA, on_table(tool()).truth) > 0).sum()
    assert 0.3 * whole < inside < 0.9 * whole
    assert np.median(errors(scene, range(5))) < 0.05


def test_hidden_object_keeps_the_operators_pose_with_low_confidence(scene) -> None:
    for seed in range(3):
        start = started(scene, seed)
        rows, columns = np.mgrid[: VGA.height, : VGA.width]
        screen = (0.35 + 0.00005 * rows + 0.002 * np.sin(columns / 20.0)).astype(np.float32)
        estimate = snap(scene.model, screen, VGA, start, rng=np.random.default_rng(seed))
        np.testing.assert_array_equal(estimate.T_camera_object, pose.checked(start, "start"))
        assert estimate.confidence < 0.1
