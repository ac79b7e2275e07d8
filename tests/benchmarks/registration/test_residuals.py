"""Statistics of depth's errors are what went into the depth."""

import numpy as np
import pytest

from benchmarks.registration.residuals import RIM, correlation_length, residuals
from registration_core.synthetic.sensors import field

SHAPE = (240, 320)
SQUARE = (slice(40, 200), slice(80, 240))
NEAR, FAR = np.float32(0.5), np.float32(0.7)


def scene() -> tuple[np.ndarray, np.ndarray]:
    """Perfect depth of a square before a wall, and whose pixels are whose."""
    perfect, owner = np.full(SHAPE, FAR), np.full(SHAPE, -1, dtype=np.int32)
    perfect[SQUARE], owner[SQUARE] = NEAR, 0
    return perfect, owner


def test_perfect_depth_is_off_by_nothing() -> None:
    perfect, owner = scene()
    perfect += np.random.default_rng(0).random(SHAPE, np.float32) * np.float32(1e-6)
    found = residuals(perfect, perfect, owner, 0)
    assert found is not None
    assert (found.bias, found.spread, found.p95, found.off) == (0.0, 0.0, 0.0, (0.0, 0.0, 0.0))
    assert (found.missing_inside, found.missing_rim) == (0.0, 0.0)
    assert found.distance == pytest.approx(0.5, abs=1e-5)
    assert np.array_equal(found.rim, np.zeros((RIM, 4)))
    assert np.array_equal(found.beyond, np.zeros((RIM, 2)))


def test_bias_and_spread_are_told_apart() -> None:
    perfect, owner = scene()
    rng = np.random.default_rng(0)
    depth = (perfect + 0.002 + 0.001 * rng.normal(size=SHAPE)).astype(np.float32)
    found = residuals(depth, perfect, owner, 0)
    assert found is not None
    assert found.bias == pytest.approx(0.002, abs=5e-5)
    assert found.spread == pytest.approx(0.001, rel=0.05)
    assert found.p95 == pytest.approx(0.00196, rel=0.05)
    assert found.off[0] == pytest.approx(0.159, abs=0.01)


def test_pixels_fall_into_classes_and_what_hides_the_object_into_none() -> None:
    perfect, owner = scene()
    depth = perfect.copy()
    depth[40:80, 80:240] += np.float32(0.004)
    depth[80:90, 80:240] -= np.float32(0.008)
    depth[90:100, 80:240] += np.float32(0.020)
    depth[100:120, 80:240] -= np.float32(0.2)
    found = residuals(depth, perfect, owner, 0)
    assert found is not None
    assert found.off == pytest.approx((40 / 140, 10 / 140, 10 / 140))


@pytest.mark.parametrize("radius", [2.0, 4.0, 8.0])
def test_the_correlation_length_is_twice_the_radius_of_a_field(radius: float) -> None:
    values = field((600, 600), radius, np.random.default_rng(1))
    used = np.random.default_rng(2).random(values.shape) < 0.6
    assert correlation_length(values, used) == pytest.approx(2 * radius, rel=0.1)


def test_independent_noise_has_no_correlation() -> None:
    values = np.random.default_rng(0).normal(size=(100, 100))
    assert correlation_length(values, np.ones(values.shape, dtype=bool)) < 1.0


def test_missing_pixels_count_where_they_are() -> None:
    perfect, owner = scene()
    depth = perfect.copy()
    depth[40:42, 80:240] = 0.0
    depth[:, 240:243] = 0.0
    found = residuals(depth, perfect, owner, 0)
    assert found is not None
    assert found.missing_inside == 0.0
    assert found.missing_rim == pytest.approx(2 * 160 / (160**2 - 152**2))
    assert found.rim[:, 3] == pytest.approx(
        [162 / (4 * 159), 158 / (4 * 157), *[0.0] * (RIM - 2)]
    )  # rings of a square
    assert found.beyond[:3, 1] == pytest.approx(0.25, abs=0.02)
    assert found.beyond[3:, 1] == pytest.approx(0.0, abs=0.02)  # corners


def test_a_rim_that_grows_claims_what_lies_beyond() -> None:
    perfect, owner = scene()
    depth = perfect.copy()
    depth[38:202, 78:242] = NEAR
    depth[40:42, 100:200] = FAR
    found = residuals(depth, perfect, owner, 0)
    assert found is not None
    assert found.beyond[:, 0] == pytest.approx([1.0, 1.0, 0.0, 0.0, 0.0, 0.0], abs=0.02)  # corners
    assert found.rim[0, 2] == pytest.approx(100 / (4 * 159))


def test_too_few_pixels_have_no_statistics() -> None:
    perfect, owner = scene()
    assert residuals(perfect, perfect, owner, 1) is None
    assert residuals(np.zeros_like(perfect), perfect, owner, 0) is None
