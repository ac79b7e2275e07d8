from typing import Any

import numpy as np
import open3d as o3d
import pytest

from registration_core.geometry import pose
from registration_core.geometry.pose_error import adi, mssd
from registration_core.synthetic.objects import ProceduralObject, demo_objects, random_distractor

OBJECTS = {known.name: known for known in demo_objects()}


@pytest.fixture(params=OBJECTS)
def known(request) -> ProceduralObject:
    return OBJECTS[request.param]


def test_there_are_five_objects_of_plausible_size():
    assert list(OBJECTS) == ["drill", "mug", "bottle", "bowl", "box"]
    assert all(0.12 < known.model.diameter < 0.30 for known in OBJECTS.values())


def test_meshes_are_light_coloured_and_centred(known):
    assert len(known.mesh.faces) < 8000
    assert len(np.unique(known.mesh.visual.vertex_colors, axis=0)) >= 2
    assert known.model.centre == pytest.approx([0, 0, 0], abs=1e-9)


def seen_normals(known: ProceduralObject) -> tuple[np.ndarray, np.ndarray]:
    """Rays from all around that hit the mesh, and the normals of the faces they hit first."""
    rng = np.random.default_rng(0)
    origins = rng.normal(size=(4000, 3))
    origins /= np.linalg.norm(origins, axis=1, keepdims=True)
    targets = known.mesh.triangles_center[rng.integers(len(known.mesh.faces), size=4000)]
    directions = targets - origins
    scene: Any = o3d.t.geometry.RaycastingScene()
    tensor: Any = o3d.core.Tensor
    scene.add_triangles(known.mesh.vertices.astype(np.float32), known.mesh.faces.astype(np.uint32))
    hits = scene.cast_rays(tensor(np.hstack([origins, directions]).astype(np.float32)))
    hit = np.isfinite(hits["t_hit"].numpy())
    return directions[hit], hits["primitive_normals"].numpy()[hit]


def test_faces_look_outwards_and_leave_no_gap(known):
    directions, normals = seen_normals(known)
    assert (np.einsum("ij,ij->i", directions, normals) < 0).mean() > 0.999


def test_authored_symmetries_map_the_surface_onto_itself(known):
    for T in known.model.symmetry_transforms[::20]:
        assert adi(T, np.eye(4), known.mesh.vertices) < 0.003  # vertices lie that close


def test_drill_and_mug_have_no_symmetry():
    for name in ("drill", "mug"):
        model = OBJECTS[name].model
        assert len(model.symmetry_transforms) == 1
        turns = [pose.exp([0, 0, 0, *angle * axis]) for axis in np.eye(3) for angle in (np.pi / 2, np.pi)]
        assert min(adi(T, np.eye(4), model.vertices) for T in turns) > 0.003


def test_the_boxs_half_turns_move_its_corners():
    model = OBJECTS["box"].model
    assert len(model.symmetry_transforms) == 4
    for T in model.symmetry_transforms[1:]:
        assert mssd(T, np.eye(4), model.vertices) > 0.1
        assert mssd(T, np.eye(4), model.vertices, model.symmetry_transforms) < 1e-9


def test_distractors_vary_and_come_again_with_the_seed():
    first, again = ([random_distractor(rng) for _ in range(12)] for rng in map(np.random.default_rng, (3, 3)))
    assert len({thing.name for thing in first}) >= 4
    assert [a.model.content_hash for a in first] == [b.model.content_hash for b in again]
    assert all(0.03 < thing.model.diameter < 0.22 for thing in first)
