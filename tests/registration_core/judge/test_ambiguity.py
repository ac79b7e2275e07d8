"""What depth cannot tell is reported with its axis, and nothing else is."""

import numpy as np
import pytest
import trimesh

from registration_core import Intrinsics, ObjectModel, Symmetries, snap, snap_views
from registration_core.geometry import pose
from registration_core.geometry.object_model import ContinuousSymmetry, discrete
from registration_core.rendering.rasterizer import render_depth
from tests.registration_core.simple_scene import block, model_of, nearest, noisy, standing_tool

CAMERA = Intrinsics(320, 240, 300.0, 300.0, 159.5, 119.5)
LYING = pose.exp([0.02, 0.0, 0.7, -2.0, 0.3, 0.0])
HALF_TURNS = discrete([pose.exp([0.0, 0.0, 0.0, *np.pi * axis]).round(12) for axis in np.eye(3)])


def can(symmetries: Symmetries | None = None) -> ObjectModel:
    """A can whose axis is z, with a step so that it has a top and a bottom."""
    top = trimesh.creation.cylinder(0.02, 0.05, sections=64)
    top.apply_translation((0.0, 0.0, 0.06))
    return model_of(trimesh.creation.cylinder(0.035, 0.08, sections=64), top, symmetries=symmetries)


def on_a_wall(model: ObjectModel, T):
    """What a camera sees of an object before a wall that stands behind it, askew."""
    wall = model_of(block((2.0, 2.0, 0.01)))
    return noisy(
        nearest(render_depth(wall, CAMERA, pose.exp([0, 0, 0.9, 0.4, 0, 0])), render_depth(model, CAMERA, T))
    )


def snapped(model: ObjectModel, T=LYING):
    start = pose.perturbed(T, 0.01, 0.1, np.random.default_rng(0))
    return snap(model, on_a_wall(model, T), CAMERA, start, rng=np.random.default_rng(0))


def test_object_without_symmetry_in_full_view_is_not_ambiguous() -> None:
    scene = standing_tool()
    start = pose.perturbed(scene.truth, 0.02, 0.2, np.random.default_rng(0))
    estimate = snap(scene.model, scene.depth, scene.camera, start, rng=np.random.default_rng(0))
    assert estimate.ambiguities == ()


def test_spin_of_a_can_that_is_not_known_to_be_round_is_free() -> None:
    (free,) = [found for found in snapped(can()).ambiguities if found.kind == "free motion"]
    assert free.motion == "turn"
    np.testing.assert_allclose(np.abs(free.axis), [0.0, 0.0, 1.0], atol=0.05)
    assert free.extent > 0.2


def test_spin_of_a_can_that_is_known_to_be_round_is_no_ambiguity() -> None:
    assert snapped(can(Symmetries(continuous=(ContinuousSymmetry((0.0, 0.0, 1.0)),)))).ambiguities == ()


@pytest.mark.parametrize("symmetries", [Symmetries(), HALF_TURNS])
def test_half_turn_of_a_box_is_another_mode_unless_it_is_known(symmetries) -> None:
    box = model_of(block((0.14, 0.09, 0.05)), symmetries=symmetries)
    T = LYING
    # a start right between a pose and its half turn
    start = T @ pose.exp([0.0, 0.0, 0.0, 0.0, 0.0, np.pi / 2])
    estimate = snap(
        box, on_a_wall(box, T), CAMERA, start, rng=np.random.default_rng(0), start_spread=(0.03, 1.5)
    )
    others = [found for found in estimate.ambiguities if found.kind == "other mode"]
    if symmetries.discrete:
        assert others == []
    else:
        assert others[0].motion == "turn"
        assert others[0].extent == pytest.approx(np.pi, abs=0.1)
        assert np.abs(others[0].axis).max() > 0.98
        assert not estimate.certificates.non_degenerate  # though depth fits: what it cannot tell apart is one
        assert estimate.confidence > 0.9


def test_hidden_object_may_be_anywhere() -> None:
    screen = np.full((CAMERA.height, CAMERA.width), 0.3, np.float32)
    estimate = snap(can(), screen, CAMERA, LYING, rng=np.random.default_rng(0))
    assert {found.motion for found in estimate.ambiguities} == {"turn", "shift"}


def test_what_one_view_leaves_free_another_holds() -> None:
    """A long bar that is cut by the image on both sides may be anywhere along it."""
    bar = model_of(block((0.8, 0.05, 0.05)), block((0.02, 0.02, 0.06), (0.35, 0.0, 0.05)))
    T = pose.exp([0.0, 0.0, 0.5, -2.0, 0.0, 0.0])
    near = Intrinsics(160, 240, 300.0, 300.0, 79.5, 119.5)
    depth = noisy(render_depth(bar, near, T))
    start = T @ pose.exp([0.004, 0.002, 0.0, 0.01, 0.0, 0.0])
    one = snap(bar, depth, near, start, rng=np.random.default_rng(0))
    (free,) = [found for found in one.ambiguities if found.motion == "shift"]
    np.testing.assert_allclose(np.abs(free.axis), [1.0, 0.0, 0.0], atol=0.1)
    T_world_far = pose.exp([0.0, 0.0, -0.6, 0.0, 0.0, 0.0])
    far = noisy(render_depth(bar, CAMERA, pose.inverse(T_world_far) @ T))
    views = [(depth, near, np.eye(4)), (far, CAMERA, T_world_far)]
    both = snap_views(bar, views, start, rng=np.random.default_rng(0))
    assert [found for found in both.ambiguities if found.motion == "shift"] == []
