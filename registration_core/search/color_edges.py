# mypy: allow-untyped-defs
"""Where a colour image changes: along the outline of an object it mostly does, and depth knows nothing of it.

A change counts beside how much the colours change all around, so a busy image says no more than a plain one;
in a dark one fewer changes stand out of the noise. Colour tells something of depth only where both were taken
from one place at one time; `color_is_aligned` asks the images themselves.
"""

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from registration_core.geometry.kernels import FAST, Array32, f4

MORE = 1.5
"""Times the median gradient of the image around, and ..."""
NOISE = 20.0
"""... this beside it, levels of 256 a pixel times 32: no flat image is all edges."""

BORDER = 2
"""Pixels along the border of an image where its gradient is not known."""

SPARSE = 3
"""Every so manieth pixel in both directions tells what is usual."""

STEP = 0.02
"""Metres of depth, for each metre of distance, ..."""
GAP = 3
"""... between pixels that are no farther apart, with nothing measured between them: one thing ends there."""
ASIDE = 12
"""Pixels by which the images are shifted against each other, to see what colours do elsewhere."""
LEAST_STEPS = 200
"""Pixels beside steps without which nothing can be told."""
RISE = 0.1
"""By which the mean logarithm of the gradient must be higher at steps of the depth than aside of them."""


def color_changes(color: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Pixels (H, W) of an image (H, W, 3) with a gradient well above what is usual in it, BORDER aside."""
    if color.size == 0:
        return np.zeros(color.shape[:2], np.bool_)
    gradients = _gradients(np.array(color, order="C"))  # a copy: a read-only image would be compiled for anew
    usual = np.median(gradients[::SPARSE, ::SPARSE])
    return np.asarray(gradients > f4(MORE * (usual + NOISE)))


def color_is_aligned(color: ArrayLike, depth: ArrayLike) -> bool:
    """Whether the colour image (H, W, 3) of bytes shows that it belongs to the depth image (H, W), metres:
    whether colours change more where the depth steps than some pixels aside.

    False where too little steps to tell.

    Raises:
        ValueError: where the colour image is none, or of another size than the depth.
    """
    image = checked_color(color, np.shape(depth))
    rows, columns = np.nonzero(_inner(depth_steps(np.asarray(depth, dtype=np.float32)), ASIDE))
    if len(rows) < LEAST_STEPS:
        return False
    change = np.log(_gradients(np.array(image, order="C")) + f4(NOISE))
    aside = [
        change[rows + down, columns + right].mean()
        for down, right in ((-ASIDE, 0), (ASIDE, 0), (0, -ASIDE), (0, ASIDE))
    ]
    return bool(change[rows, columns].mean() > np.mean(aside) + RISE)


def depth_steps(depth: Array32) -> NDArray[np.bool_]:
    """Pixels (H, W) beside a step of the depth [m], on its nearer side."""
    steps = np.zeros(depth.shape, np.bool_)
    for apart in range(1, GAP + 1):
        for image, found in ((depth, steps), (depth.T, steps.T)):
            first, second = image[:-apart], image[apart:]
            beside = (first > 0) & (second > 0)
            for between in range(1, apart):
                beside &= image[between : between - apart] == 0
            found[:-apart] |= beside & (second - first > STEP * first)
            found[apart:] |= beside & (first - second > STEP * second)
    return steps


def _inner(mask: NDArray[np.bool_], border: int) -> NDArray[np.bool_]:
    """A mask (H, W) without what lies so many pixels from the border."""
    inner = np.zeros_like(mask)
    inner[border:-border, border:-border] = mask[border:-border, border:-border]
    return inner


def checked_color(color: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """The colour image (H, W, 3) as it is.

    Raises:
        ValueError: where it is no image of bytes, or its size is not the depth's, `shape` (H, W).
    """
    image = np.asarray(color)
    if image.dtype != np.uint8 or image.shape != (*shape, 3):
        raise ValueError(
            f"color must be bytes (uint8) of the shape (height, width, 3) of the depth, {(*shape, 3)};"
            f" it has {image.dtype} {image.shape}"
        )
    return image


@njit(**FAST)
def _gradients(color):
    """Magnitude of the gradient (H, W), times 32, of the channel where it is largest; the image is smoothed
    by a binomial filter of three pixels first. It is 0 in the BORDER.
    """
    height, width = color.shape[0], color.shape[1]
    gradients = np.zeros((height, width), np.float32)
    across, smooth = np.zeros((3, height, width), np.int32), np.zeros((3, height, width), np.int32)
    for k in range(3):
        for i in range(height):
            for j in range(1, width - 1):
                across[k, i, j] = (
                    np.int32(color[i, j - 1, k]) + 2 * np.int32(color[i, j, k]) + np.int32(color[i, j + 1, k])
                )
        for i in range(1, height - 1):
            for j in range(1, width - 1):
                smooth[k, i, j] = across[k, i - 1, j] + 2 * across[k, i, j] + across[k, i + 1, j]
        for i in range(BORDER, height - BORDER):
            for j in range(BORDER, width - BORDER):
                x = f4(smooth[k, i, j + 1] - smooth[k, i, j - 1])
                y = f4(smooth[k, i + 1, j] - smooth[k, i - 1, j])
                gradients[i, j] = max(gradients[i, j], x * x + y * y)
    return np.sqrt(gradients)
