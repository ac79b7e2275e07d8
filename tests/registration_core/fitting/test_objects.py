"""Objects for fitting: plausible in size, different, with the symmetries that they are said to have."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from registration_core.fitting.objects import CELL, KINDS, built_of_cells, random_object
from registration_core.geometry import pose
from registration_core.search.viewpoint_model import build_viewpoint_model


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_objects_of_a_kind_differ_and_can_be_held_in_a_hand(kind) -> None:
    models = [random_object(kind, seed).model for seed in range(3)]
    assert all(0.04 < model.diameter < 0.3 for model in models)
    assert len({round(model.diameter, 5) for model in models}) == 3
    np.testing.assert_array_equal(random_object(kind, 1).model.vertices, models[1].vertices)


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_symmetries_put_the_surface_onto_itself(kind) -> None:
    model = random_object(kind, 0).model
    views = build_viewpoint_model(model)
    tree, points = cKDTree(views.points[:, :, ::4].transpose(0, 2, 1).reshape(-1, 3)), views.sample
    for twin in views.symmetries:
        moved = points @ twin[:, :3].T + twin[:, 3]
        assert np.quantile(tree.query(moved)[0], 0.98) < 0.03 * model.diameter


def test_cells_make_a_solid_of_their_volume() -> None:
    height = np.zeros((4, 5))
    height[1:3, 1:4] = 0.01
    height[1, 1] = 0.004
    mesh = built_of_cells(height)
    assert mesh.volume == pytest.approx(height.sum() * CELL**2)


def test_outlines_of_symmetric_and_other_kinds_are_told_apart() -> None:
    assert len(random_object("cube", 0).model.symmetry_transforms) == 24
    assert len(random_object("mug", 0).model.symmetry_transforms) == 1
    turned = pose.exp([0, 0, 0, 0, 0, np.pi])
    assert (
        np.isclose(random_object("carton", 0).model.symmetry_transforms, turned, atol=1e-9).all((1, 2)).any()
    )
