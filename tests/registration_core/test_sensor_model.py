from dataclasses import replace

import numpy as np
import pytest

from registration_core.camera import Intrinsics
from registration_core.sensor_model import SensorModel, at_edges, facing, quantised, sensed

CAMERA = Intrinsics(width=160, height=120, fx=150.0, fy=150.0, cx=79.5, cy=59.5)
CALM = SensorModel(
    noise=0.0,
    smooth_noise=0.0,
    step=1e-7,
    jitter=0.0,
    edge_holes=0.0,
    grazing=1e-9,
    speckle_holes=0.0,
    blobs=0,
)
"""A sensor that does nothing: each test switches one effect on."""


def wall(z: float) -> np.ndarray:
    return np.full((CAMERA.height, CAMERA.width), z, dtype=np.float32)


def measure(depth: np.ndarray, **effects: float) -> np.ndarray:
    return sensed(depth, CAMERA, np.random.default_rng(0), replace(CALM, **effects))


def test_a_sensor_without_faults_returns_the_truth():
    assert measure(wall(1.3)) == pytest.approx(1.3, abs=1e-5)


def test_the_same_generator_gives_the_same_image():
    images = [sensed(wall(1.0), CAMERA, np.random.default_rng(5)) for _ in range(2)]
    assert np.array_equal(*images)
    assert images[0].dtype == np.float32


@pytest.mark.parametrize("effect", ["noise", "smooth_noise"])
def test_noise_grows_with_distance_squared(effect):
    spread = [float(np.std(measure(wall(z), **{effect: 0.002}) - z)) for z in (0.5, 1.0, 2.0)]
    assert spread == pytest.approx([0.0005, 0.002, 0.008], rel=0.1)


def test_smooth_noise_is_shared_by_neighbours():
    independent = measure(wall(1.0), noise=0.002) - 1.0
    shared = measure(wall(1.0), smooth_noise=0.002) - 1.0
    likeness = [np.corrcoef(e[:, :-1].ravel(), e[:, 1:].ravel())[0, 1] for e in (independent, shared)]
    assert likeness[0] < 0.1
    assert likeness[1] > 0.9


def test_steps_grow_with_distance_squared():
    for z, step in ((0.5, 0.00025), (1.0, 0.001), (2.0, 0.004)):
        levels = np.unique(quantised(np.linspace(0.97 * z, 1.03 * z, 5000, dtype=np.float32), 0.001))
        assert np.median(np.diff(levels)) == pytest.approx(step, rel=0.1)


def test_nothing_stays_nothing():
    depth = wall(1.0)
    depth[:40] = 0.0
    assert not sensed(depth, CAMERA, np.random.default_rng(0), replace(SensorModel(), jitter=0.0))[:39].any()
    assert quantised(np.zeros(3, dtype=np.float32), 0.001).tolist() == [0.0, 0.0, 0.0]


def test_holes_are_at_edges_only():
    depth = wall(1.0)
    depth[:, 80:] = 1.2
    lost = measure(depth, edge_holes=0.7) == 0.0
    assert lost[:, 79:81].mean() == pytest.approx(0.7, abs=0.12)
    assert not lost[:, :79].any()
    assert not lost[:, 81:].any()


def test_a_small_step_is_no_edge():
    depth = wall(1.0)
    depth[:, 80:] = 1.02
    assert not at_edges(depth, 0.03).any()


def slanted(angle: float) -> np.ndarray:
    """A plane through (0, 0, 1) turned by `angle` [rad] about y, away from frontal."""
    x = (np.arange(CAMERA.width) - CAMERA.cx) / CAMERA.fx
    row = 1.0 / (1.0 - np.tan(angle) * x)
    return (
        np.where((row > 0.0) & (row < 10.0), row, 0.0)[None].repeat(CAMERA.height, axis=0).astype(np.float32)
    )


@pytest.mark.parametrize("angle", [0.0, 0.5, 1.0, 1.3])
def test_facing_is_the_cosine_to_the_ray(angle):
    at_centre = facing(slanted(angle), CAMERA)[59:61, 79:81].mean()
    assert at_centre == pytest.approx(np.cos(angle), abs=0.01)


def test_holes_come_at_grazing_angles():
    shares = [float((measure(slanted(a), grazing=0.3)[50:70, 78:82] == 0).mean()) for a in (0.5, 1.4, 1.5)]
    assert shares[0] == 0.0
    assert 0.2 < shares[1] < shares[2]


def test_what_is_too_far_is_not_measured():
    assert not measure(wall(4.5)).any()


def test_speckles_and_blobs_leave_holes():
    assert (measure(wall(1.0), speckle_holes=0.05) == 0).mean() == pytest.approx(0.05, abs=0.01)
    assert (measure(wall(1.0), blobs=40) == 0).mean() > 0.02
