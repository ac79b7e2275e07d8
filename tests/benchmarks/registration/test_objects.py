"""Authored symmetries are true: they map each mesh onto itself."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from benchmarks.registration.objects import YCB_SYMMETRIES, known_objects, ycb_object
from registration_core import ObjectModel
from registration_core.geometry import pose


def farthest_mean(model: ObjectModel) -> float:
    mesh = trimesh.Trimesh(model.vertices, model.faces, process=False)
    tree = cKDTree(trimesh.sample.sample_surface(mesh, 20_000, seed=1)[0])
    points = trimesh.sample.sample_surface(mesh, 1000, seed=0)[0]
    every = model.symmetry_transforms[:: max(1, len(model.symmetry_transforms) // 8)]
    return max(float(tree.query(pose.apply(T, points))[0].mean()) for T in every)


@pytest.mark.parametrize(("obj_id", "order"), [(3, 4), (5, 2), (8, 4), (13, 315), (19, 2), (21, 8)])
def test_symmetries_of_real_objects(obj_id: int, order: int, shared_data: Path) -> None:
    model = ycb_object(obj_id)
    assert obj_id in YCB_SYMMETRIES
    assert len(model.symmetry_transforms) == order
    assert model.symmetry_transforms[0] == pytest.approx(np.eye(4))
    assert farthest_mean(model) < 0.0025


def test_known_objects_include_the_demos() -> None:
    assert {"drill", "mug", "bottle", "bowl", "box"} <= set(known_objects())
