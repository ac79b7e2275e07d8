"""Symmetries of shapes that everybody knows, of scanned objects, and the laws that every suggestion obeys."""

from functools import cache
from typing import Any

import numpy as np
import open3d
import pytest
import trimesh

from registration_core import ObjectModel, SuggestedSymmetry, as_symmetries, find_symmetries
from registration_core.geometry import pose
from registration_core.synthetic.objects import demo_objects
from tests.registration_core.simple_scene import block, model_of

TILTED = pose.exp([0.3, -0.2, 0.5, 0.4, 1.1, -0.8])
"""Nothing may depend on the mesh's frame: no shape below lies along its axes."""


def prism(sides: int, radius: float, height: float) -> trimesh.Trimesh:
    return trimesh.creation.cylinder(radius=radius, height=height, sections=sides)


SHAPES = {
    "box": block((0.05, 0.1, 0.15)),
    "square prism": block((0.06, 0.06, 0.15)),
    "cube": block((0.1, 0.1, 0.1)),
    "cylinder": prism(64, 0.03, 0.12),
    "cylinder of a sphere's inertia": prism(64, 0.04, 0.0832),
    "cone": trimesh.creation.cone(radius=0.04, height=0.1, sections=64),
    "hexagonal prism": prism(6, 0.04, 0.05),
    "sphere": trimesh.creation.icosphere(subdivisions=4, radius=0.05),
    "icosahedron": trimesh.creation.icosahedron(),
    "L": trimesh.util.concatenate([block((0.1, 0.03, 0.04)), block((0.03, 0.08, 0.04), (-0.035, 0.055, 0))]),
    "mug": next(o.mesh for o in demo_objects() if o.name == "mug"),
    "sheet": trimesh.Trimesh([[0, 0, 0], [0.2, 0, 0], [0.2, 0.1, 0], [0, 0.1, 0]], [[0, 1, 2], [0, 2, 3]]),
}


def tilted(name: str) -> trimesh.Trimesh:
    return SHAPES[name].copy().apply_transform(TILTED)


@cache
def found_in(name: str) -> tuple[SuggestedSymmetry, ...]:
    return find_symmetries(tilted(name))


def folds(suggestions) -> list[int]:
    """Orders, highest first; 0 stands for any angle."""
    return sorted((s.fold or 0 for s in suggestions), key=lambda fold: -(fold or np.inf))


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("box", [2, 2, 2]),
        ("square prism", [4, 2, 2, 2, 2]),
        ("cube", [4] * 3 + [3] * 4 + [2] * 6),
        ("cylinder", [0, 2]),
        ("cylinder of a sphere's inertia", [0, 2]),
        ("cone", [0]),
        ("hexagonal prism", [6] + [2] * 6),
        ("sphere", [0, 0, 0]),
        ("icosahedron", [5] * 6 + [3] * 10 + [2] * 15),
        ("L", []),
        ("mug", []),
        ("sheet", [2, 2, 2]),
    ],
)
def test_finds_the_axes_of_known_shapes(name, expected) -> None:
    assert folds(found_in(name)) == expected


@pytest.mark.parametrize(
    ("name", "rotations"),
    [
        ("box", 4), ("square prism", 8), ("cube", 24), ("hexagonal prism", 12),
        ("L", 1),
    ],
)  # fmt: skip
def test_closes_the_group(name, rotations) -> None:
    symmetries = as_symmetries(found_in(name))
    assert not symmetries.continuous
    group = symmetries.transforms(diameter=0.2)
    assert len(group) == rotations
    for a in group:
        apart = np.abs((a @ group)[:, None] - group).max(axis=(2, 3))
        assert apart.min(axis=1).max() < 1e-3


def test_the_axis_and_the_flip_of_a_cylinder() -> None:
    revolution = next(s for s in found_in("cylinder") if s.fold is None)
    flip = next(s for s in found_in("cylinder") if s.fold == 2)
    assert abs(revolution.axis @ TILTED[:3, 2]) == pytest.approx(1.0, abs=1e-5)
    assert abs(flip.axis @ TILTED[:3, 2]) < 2e-3
    np.testing.assert_allclose(revolution.origin, TILTED[:3, 3], atol=2e-4)
    symmetries = as_symmetries(found_in("cylinder"))
    assert len(symmetries.continuous) == 1
    assert len(symmetries.discrete) == 1
    mesh = tilted("cylinder")
    transforms = symmetries.transforms(0.134)
    for T in transforms[:: len(transforms) // 40]:
        assert misses(mesh, T[None], 300).max() < 0.001


def test_a_sphere_has_three_axes_at_right_angles() -> None:
    symmetries = as_symmetries(found_in("sphere"))
    assert symmetries.discrete == ()
    axes = np.array([s.axis for s in symmetries.continuous])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=0.02)


def misses(mesh: trimesh.Trimesh, transforms, count: int = 1500) -> np.ndarray:
    """Distances (K, count) of turned points of a mesh to it, computed on fresh samples."""
    points, _ = trimesh.sample.sample_surface(mesh, count, seed=99)
    tensor: Any = open3d.core.Tensor
    scene: Any = open3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(
        tensor(np.asarray(mesh.vertices, dtype=np.float32)),
        tensor(np.asarray(mesh.faces, dtype=np.uint32)),
    )
    return np.stack(
        [
            scene.compute_distance(pose.apply(T, points).astype(np.float32), nthreads=1).numpy()
            for T in transforms
        ]
    )


@pytest.mark.parametrize("name", sorted(SHAPES))
def test_a_suggestion_maps_the_surface_within_its_residual(name) -> None:
    mesh = tilted(name)
    for suggestion in found_in(name):
        assert np.linalg.norm(suggestion.axis) == pytest.approx(1.0)
        assert len(suggestion.transforms) == (suggestion.fold or 17) - 1
        off = np.percentile(misses(mesh, suggestion.transforms), 98.0, axis=1)
        assert off.max() <= suggestion.residual + 1e-6
        for T in suggestion.transforms:
            np.testing.assert_allclose(pose.apply(T, suggestion.origin), suggestion.origin, atol=1e-12)


def test_best_come_first() -> None:
    for name, shape in SHAPES.items():
        diameter = np.linalg.norm(np.ptp(shape.bounds, axis=0))
        residuals = [s.residual for s in found_in(name)]
        assert (np.diff(residuals) > -0.001 * diameter).all()


def test_equal_residuals_put_the_most_rotations_first() -> None:
    assert [s.fold for s in found_in("square prism")] == [4, 2, 2, 2, 2]


@pytest.mark.parametrize("name", ["square prism", "cone", "L"])
def test_tessellation_and_scale_do_not_matter(name) -> None:
    mesh = tilted(name)
    half = len(mesh.faces) // 2
    fine = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces[:half], 0.01)
    rest = trimesh.Trimesh(mesh.vertices, mesh.faces[half:], process=False)
    torn = trimesh.util.concatenate([trimesh.Trimesh(*fine), rest])  # neither watertight nor even
    torn.apply_scale(10.0)
    found = find_symmetries(torn)
    assert folds(found) == folds(found_in(name))
    for suggestion in found:
        assert max(abs(suggestion.axis @ s.axis) for s in found_in(name)) > np.cos(np.radians(0.5))


def test_noise_below_the_tolerance_does_not_hide_a_symmetry() -> None:
    mesh = trimesh.Trimesh(*trimesh.remesh.subdivide_to_size(*mesh_arrays(tilted("square prism")), 0.01))
    mesh.vertices += np.random.default_rng(0).normal(scale=0.0006, size=mesh.vertices.shape)
    found = find_symmetries(mesh)
    assert folds(found) == [4, 2, 2, 2, 2]
    assert 0.0003 < found[0].residual < 0.02 * 0.18
    assert len(as_symmetries(found).discrete) == 7
    assert find_symmetries(mesh, tolerance=0.002) == ()


def mesh_arrays(mesh: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def test_the_tolerance_decides_between_a_polygon_and_a_circle() -> None:
    dodecagon = prism(12, 0.05, 0.02)
    assert folds(find_symmetries(dodecagon, tolerance=0.02)) == [0, 2]
    assert folds(find_symmetries(dodecagon, tolerance=0.005)) == [12] + [2] * 12


def test_the_same_mesh_gives_the_same_suggestions() -> None:
    first, second = find_symmetries(tilted("box")), find_symmetries(tilted("box"))
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a.transforms, b.transforms)
        assert a.residual == b.residual


@pytest.mark.parametrize(
    ("number", "expected"),
    [
        (1, [0, 2]),  # master chef can
        (3, [2, 2, 2]),  # sugar box, skewed in its scan
        (5, [2]),  # mustard bottle
        (8, [2, 2, 2]),  # gelatin box
        (10, []),  # banana
        (13, [0]),  # bowl
        (14, []),  # mug
        (16, [4, 2, 2, 2, 2]),  # wood block
        (17, []),  # scissors
    ],
)
def test_scanned_objects(shared_data, number, expected) -> None:
    model = ObjectModel.load(shared_data / f"ycbv/models/obj_{number:06d}.ply", "mm")
    assert folds(find_symmetries(model)) == expected


def test_suggestions_make_a_model_that_knows_its_twins() -> None:
    mesh = tilted("square prism")
    model = model_of(mesh, symmetries=as_symmetries(find_symmetries(mesh)))
    assert len(model.symmetry_transforms) == 8
    assert np.percentile(misses(mesh, model.symmetry_transforms), 98.0, axis=1).max() < 1e-4


@pytest.mark.parametrize("tolerance", [0.0, -0.01, 0.2, np.nan])
def test_refuses_a_tolerance_that_is_none(tolerance) -> None:
    with pytest.raises(ValueError, match=r"tolerance must be a share of the diameter in \(0, 0.1\]"):
        find_symmetries(SHAPES["box"], tolerance)


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3)), "mesh must have vertices and faces"),
        (
            [[0, 0, 0], [1, 0, 0], [2, 0, 0]],
            [[0, 1, 2]],
            "mesh must have a surface; the area of its faces is 0",
        ),
        ([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]], [[0, 1, 2]], "mesh vertices must be finite numbers"),
    ],
)
def test_refuses_a_mesh_without_a_surface(vertices, faces, message) -> None:
    with pytest.raises(ValueError, match=message):
        find_symmetries(trimesh.Trimesh(vertices, faces, process=False))
