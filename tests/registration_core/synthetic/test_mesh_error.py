import numpy as np
import pytest

from registration_core.synthetic.mesh_error import imprecise
from registration_core.synthetic.objects import demo_objects

MODEL = demo_objects()[0].model


def test_the_same_seed_gives_the_same_mesh():
    one, same, other = (imprecise(MODEL, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert np.array_equal(one.vertices, same.vertices)
    assert not np.array_equal(one.vertices, other.vertices)
    assert one.faces is MODEL.faces
    assert one.symmetries == MODEL.symmetries


def test_no_vertex_moves_further_than_size_and_warp_allow():
    moved = [
        np.linalg.norm(imprecise(MODEL, np.random.default_rng(seed)).vertices - MODEL.vertices, axis=1).max()
        for seed in range(20)
    ]
    assert 0.0005 * MODEL.diameter < max(moved) <= 0.01 * MODEL.radius * np.sqrt(3) + 0.005 * MODEL.diameter


def test_the_size_is_off_along_each_axis():
    factors = np.ptp(imprecise(MODEL, np.random.default_rng(0), 0.02, 0.0).vertices, axis=0) / np.ptp(
        MODEL.vertices, axis=0
    )
    assert len(set(np.round(factors, 6))) == 3
    assert np.all(np.abs(factors - 1.0) <= 0.02)


def test_a_warp_is_smooth():
    """Neighbours move alike: no edge of the mesh changes its length by more than a few per cent."""
    warped = imprecise(MODEL, np.random.default_rng(0), 0.0, 0.005)

    def edges(vertices: np.ndarray) -> np.ndarray:
        return np.linalg.norm(vertices[MODEL.faces[:, 0]] - vertices[MODEL.faces[:, 1]], axis=1)

    own = edges(MODEL.vertices)
    assert edges(warped.vertices)[own > 0] / own[own > 0] == pytest.approx(1.0, abs=0.06)
    assert not np.allclose(warped.vertices, MODEL.vertices, atol=1e-5)
