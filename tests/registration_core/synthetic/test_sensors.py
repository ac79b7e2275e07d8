from typing import Any

import numpy as np
import pytest

from registration_core.geometry.camera import Intrinsics
from registration_core.synthetic.sensors import (
    Sensor,
    at_edges,
    blended,
    facing,
    field,
    in_shadow,
    measure,
    quantised,
)

CAMERA = Intrinsics(width=160, height=120, fx=150.0, fy=150.0, cx=79.5, cy=59.5)


def wall(z: float) -> np.ndarray:
    return np.full((CAMERA.height, CAMERA.width), z, dtype=np.float32)


def measured(depth: np.ndarray, **errors: Any) -> np.ndarray:
    """By a sensor that has these errors alone."""
    return measure(depth, CAMERA, np.random.default_rng(0), Sensor(**errors))


def step(near: float, far: float) -> np.ndarray:
    """A wall whose right half is further away."""
    depth = wall(near)
    depth[:, 80:] = far
    return depth


def test_a_sensor_without_faults_returns_the_truth():
    assert np.array_equal(measured(step(1.0, 1.3)), step(1.0, 1.3))


@pytest.mark.parametrize("effect", ["noise", "waves"])
def test_noise_grows_with_distance_squared(effect):
    spread = [float(np.std(measured(wall(z), **{effect: 0.002}) - z)) for z in (0.5, 1.0, 2.0)]
    assert spread == pytest.approx([0.0005, 0.002, 0.008], rel=0.1)


def test_waves_are_shared_by_neighbours():
    independent = measured(wall(1.0), noise=0.002) - 1.0
    shared = measured(wall(1.0), waves=0.002) - 1.0
    likeness = [np.corrcoef(e[:, :-1].ravel(), e[:, 1:].ravel())[0, 1] for e in (independent, shared)]
    assert likeness[0] < 0.1
    assert likeness[1] > 0.9


def test_steps_grow_with_distance_squared():
    for z, step in ((0.5, 0.00025), (1.0, 0.001), (2.0, 0.004)):
        levels = np.unique(quantised(np.linspace(0.97 * z, 1.03 * z, 5000, dtype=np.float32), 0.001))
        assert np.median(np.diff(levels)) == pytest.approx(step, rel=0.1)


def test_holes_are_at_edges_only():
    lost = measured(step(1.0, 1.2), edge_holes=0.7) == 0.0
    assert lost[:, 79:81].mean() == pytest.approx(0.7, abs=0.12)
    assert not lost[:, :79].any()
    assert not lost[:, 81:].any()


def test_holes_along_rims_are_as_wide_as_wanted_and_wavy():
    lost = measured(step(1.0, 1.2), rim_holes=4.0) == 0.0
    assert lost.sum(axis=1).mean() == pytest.approx(2 * 4.0, abs=2.5)
    assert lost.sum(axis=1).std() > 1.5
    assert not lost[:, :55].any()
    assert not lost[:, 105:].any()


def test_a_small_step_is_no_edge():
    assert not at_edges(step(1.0, 1.02), 0.03).any()


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
    shares = [float((measured(slanted(a), grazing=0.3)[50:70, 78:82] == 0).mean()) for a in (0.5, 1.4, 1.5)]
    assert shares[0] == 0.0
    assert 0.2 < shares[1] < shares[2]


def test_what_is_too_far_is_not_measured():
    assert not measured(wall(4.5)).any()


def test_speckles_and_blobs_leave_holes():
    assert (measured(wall(1.0), speckle_holes=0.05) == 0).mean() == pytest.approx(0.05, abs=0.01)
    assert (measured(wall(1.0), blobs=40) == 0).mean() > 0.02


@pytest.mark.parametrize("radius", [2.0, 4.0, 7.0, 10.0])
def test_a_field_is_as_smooth_as_wanted(radius):
    """The correlation of white noise under a Gaussian window falls to 1/e at twice its radius."""
    shape = (700, 700)
    values = field(shape, radius, np.random.default_rng(0))
    assert (values.shape, values.std()) == (shape, pytest.approx(1.0))
    distance = round(2 * radius)
    for one, other in (
        (values[:, :-distance], values[:, distance:]),
        (values[:-distance], values[distance:]),
    ):
        assert (one * other).mean() == pytest.approx(np.exp(-1), abs=0.12)


def test_depth_is_displaced_against_the_pixels():
    moved = measured(step(1.0, 1.2), shift=(3.0, 0.0))
    assert np.array_equal(moved[:, 3:], step(1.0, 1.2)[:, :-3])
    depth = step(1.0, 1.2).T[:, :120].copy()
    camera = Intrinsics(width=120, height=160, fx=150.0, fy=150.0, cx=59.5, cy=79.5)
    moved = measure(depth, camera, np.random.default_rng(0), Sensor(shift=(0.0, -2.0)))
    assert np.array_equal(moved[:-2], depth[2:])


@pytest.mark.parametrize(("errors", "shares"), [({"warp": 1.5}, (0.5, 1.0)), ({"jitter": 1.5}, (-0.2, 0.2))])
def test_rims_are_wavy_or_frayed(errors, shares):
    """Neighbours in a wavy rim lie at about the same column, in a frayed one they do not."""
    rims = (measured(step(1.0, 1.2), **errors) == 1.0).sum(axis=1)
    assert 0.7 < rims.std() < 6.0
    least, most = shares
    assert least < np.corrcoef(rims[:-1], rims[1:])[0, 1] < most


def test_the_near_surface_grows_over_the_far_one():
    grown = measured(step(1.0, 1.2), growth=3.0)
    assert (grown == np.float32(1.0)).sum(axis=1).tolist() == [83] * CAMERA.height
    assert np.array_equal(measured(step(1.0, 1.01), growth=3.0), step(1.0, 1.01))


def test_nothing_grows_over_what_is_not_measured():
    depth = step(1.0, 0.0)
    assert np.array_equal(measured(depth, growth=3.0), depth)


def test_small_steps_are_blended_and_large_ones_are_not():
    melted = measured(step(1.0, 1.01), blend=3.0, blend_gap=0.02)
    assert np.all(np.diff(melted[60]) >= 0.0)
    assert melted[60, 79] == pytest.approx(1.005, abs=0.001)
    assert np.diff(melted[60]).max() < 0.002
    assert measured(step(1.0, 1.1), blend=3.0, blend_gap=0.02) == pytest.approx(step(1.0, 1.1), abs=1e-6)


def test_blending_leaves_a_slanted_plane():
    plane = slanted(0.6)
    inside = (slice(20, -20), slice(20, -20))
    assert blended(plane, 3.0, 0.05)[inside] == pytest.approx(plane[inside], abs=0.0005)


def test_concave_corners_are_rounded_towards_the_camera():
    columns = np.abs(np.arange(CAMERA.width) - 80.0)
    concave = (1.2 - 0.002 * columns)[None].repeat(CAMERA.height, axis=0).astype(np.float32)
    error = measured(concave, rounding=0.5, rounding_radius=8.0) - concave
    assert error[60, 80] < -0.004
    assert np.abs(error[:, 40:50]).max() < 0.001
    convex = (2.4 - concave).astype(np.float32)
    assert np.abs(measured(convex, rounding=0.5, rounding_radius=8.0) - convex)[:, 60:100].max() < 0.001


def test_pixels_at_edges_fly_between_the_surfaces():
    flown = measured(step(1.0, 1.2), flying=0.6)
    rim = flown[:, 79:81]
    between = (rim > 1.0) & (rim < 1.2)
    assert between.mean() == pytest.approx(0.6, abs=0.12)
    assert np.array_equal(flown[:, :79], wall(1.0)[:, :79])


def test_a_bias_grows_with_distance_squared_and_an_offset_does_not():
    errors = [
        [float(np.mean(measured(wall(z), **{name: 0.004}) - z)) for z in (0.5, 2.0)]
        for name in ("bias", "offset")
    ]
    assert errors == [pytest.approx([0.001, 0.016], rel=1e-3), pytest.approx([0.004, 0.004], rel=1e-3)]


def test_depth_is_stored_in_whole_units():
    raw = measured(slanted(0.5), unit=0.001) / 0.001
    assert raw == pytest.approx(np.rint(raw), abs=1e-3)
    assert raw == pytest.approx(slanted(0.5) / 0.001, abs=0.5 + 1e-3)


def test_shadows_lie_on_the_side_away_from_the_projector():
    """Behind a near strip, as wide as the disparities differ, whichever side the projector stands on."""
    depth = wall(1.0)
    depth[:, 70:90] = 0.5
    disparity = 150.0 * 0.05 * (1 / 0.5 - 1 / 1.0)
    for baseline, side in ((0.05, slice(None, 70)), (-0.05, slice(90, None))):
        hidden = in_shadow(depth, CAMERA, baseline)
        assert hidden[:, side].sum(axis=1) == pytest.approx(disparity, abs=2.0)
        assert hidden.sum() == hidden[:, side].sum()


def test_lines_are_lost_at_their_period():
    lost = measured(wall(1.0), lines=5.0) == 0.0
    assert lost.mean() == pytest.approx(1.0 - 0.8**2, abs=0.01)
    assert lost.all(axis=0).sum() == pytest.approx(160 / 5, abs=1)


@pytest.mark.parametrize("errors", [{"patches": 0.1}, {"grazing": 0.5}])
def test_holes_come_in_patches_as_many_and_as_wide_as_wanted(errors):
    depth = slanted(1.1) if "grazing" in errors else wall(1.0)
    part = (slice(None), slice(60, 100))
    widths = []
    for radius in (0.0, 4.0):
        lost = (measured(depth, patch_radius=radius, **errors) == 0.0)[part]
        assert lost.mean() == pytest.approx(0.1, abs=0.06)
        widths.append(2.0 * lost.sum() / np.count_nonzero(np.diff(lost, axis=1)))
    assert widths[0] < 2.0
    assert widths[1] > 4.0
