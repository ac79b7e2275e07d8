"""Where colours change, and whether a colour image belongs to its depth."""

import numpy as np
import pytest

from registration_core.search.color_edges import (
    LEAST_STEPS,
    checked_color,
    color_changes,
    color_is_aligned,
    depth_steps,
)
from tests.registration_core.simple_scene import CAMERA, standing_tool

SIZE = (60, 80)


def halves(left: tuple[int, int, int], right: tuple[int, int, int]) -> np.ndarray:
    """Two colours, side by side."""
    image = np.empty((*SIZE, 3), np.uint8)
    image[:, :40], image[:, 40:] = left, right
    return image


@pytest.mark.parametrize("right", [(200, 40, 40), (40, 200, 40), (60, 40, 40)])
def test_a_change_of_any_channel_is_seen_where_it_is(right) -> None:
    changes = color_changes(halves((40, 40, 40), right))
    assert changes[5:-5, 39:41].all()
    assert not changes[:, :37].any() and not changes[:, 43:].any()


def test_a_plain_image_changes_nowhere() -> None:
    noise = np.random.default_rng(0).integers(0, 2, (*SIZE, 3))
    assert color_changes((120 + noise).astype(np.uint8)).mean() < 0.01


def test_a_change_counts_beside_what_is_usual_in_the_image() -> None:
    busy = np.random.default_rng(0).integers(0, 256, (*SIZE, 3)).astype(np.uint8)
    assert color_changes(busy).mean() < 0.2
    step = halves((40, 40, 40), (60, 60, 60))
    mixed = np.where(np.arange(80)[None, :, None] < 20, busy, step)
    assert color_changes(mixed)[5:-5, 39:41].all()


def test_an_image_without_pixels_changes_nowhere() -> None:
    assert color_changes(np.zeros((0, 5, 3), np.uint8)).shape == (0, 5)


def test_steps_are_marked_on_the_nearer_side_across_small_holes() -> None:
    depth = np.full((9, 12), 0.5, np.float32)
    depth[:, 6:] = 0.7
    assert [int(k) for k in np.flatnonzero(depth_steps(depth).any(axis=0))] == [5]
    depth[:, 5:7] = 0.0
    assert [int(k) for k in np.flatnonzero(depth_steps(depth).any(axis=0))] == [4]
    depth[:, 4:8] = 0.0
    assert not depth_steps(depth).any()
    assert (depth_steps(depth.T.copy()) == depth_steps(depth).T).all()


def painted(depth: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Things near and far in colours of their own, with noise."""
    near = (depth > 0) & (depth < np.median(depth[depth > 0]))
    image = np.where(near[..., None], (170, 90, 60), (70, 90, 120))
    return np.clip(image + rng.normal(0.0, 3.0, image.shape), 0, 255).astype(np.uint8)


def stepped() -> np.ndarray:
    """Depth of boxes on a floor."""
    depth = np.full((240, 320), 0.9, np.float32)
    for row, column in ((30, 40), (60, 200), (150, 100), (140, 240)):
        depth[row : row + 50, column : column + 55] = 0.7
    return depth


def test_colour_that_lies_on_the_depth_is_found_to() -> None:
    depth, rng = stepped(), np.random.default_rng(0)
    color = painted(depth, rng)
    assert color_is_aligned(color, depth)
    assert color_is_aligned(np.roll(color, (2, -2), axis=(0, 1)), depth)  # as cameras side by side leave it
    assert not color_is_aligned(np.roll(color, (25, 25), axis=(0, 1)), depth)
    assert not color_is_aligned(rng.integers(0, 256, color.shape).astype(np.uint8), depth)
    assert not color_is_aligned(np.full_like(color, 90), depth)


def test_without_steps_nothing_is_found() -> None:
    scene = standing_tool()
    flat = np.full_like(scene.depth, 0.8)
    assert depth_steps(flat).sum() < LEAST_STEPS
    assert not color_is_aligned(painted(flat, np.random.default_rng(0)), flat)


def test_no_image_of_bytes_is_refused() -> None:
    good = np.zeros((CAMERA.height, CAMERA.width, 3), np.uint8)
    size, depth = good.shape[:2], np.ones(good.shape[:2], np.float32)
    assert checked_color(good, size) is good
    for bad in (good.astype(float), good[..., 0], good[:-1], good.tolist()):
        with pytest.raises(ValueError, match="color must be bytes"):
            checked_color(bad, size)
        with pytest.raises(ValueError, match="color must be bytes"):
            color_is_aligned(bad, depth)
