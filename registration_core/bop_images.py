"""Images of BOP datasets: found, decoded whole, and turned into metres."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from registration_core.bop_fields import METRES_PER_MILLIMETRE, BopFormatError

COLOR_FILES = [(folder, suffix) for folder in ("rgb", "gray") for suffix in (".png", ".jpg", ".jpeg")]
"""Where a scene may keep its pictures, best first."""

DEPTH_MODES = ("I;16", "I;16B", "I")
"""Pillow's names of 16-bit greyscale."""


def read_depth(path: Path, depth_scale: float) -> NDArray[np.float32]:
    """Depth (H, W) in metres, 0 where nothing was measured, of a 16-bit PNG; raw * depth_scale is mm.

    Raises:
        BopFormatError: where it is no readable 16-bit greyscale image.
    """
    raw = np.asarray(decoded_depth(path, path.name), dtype=np.float32)
    return raw * np.float32(depth_scale * METRES_PER_MILLIMETRE)


def read_color(path: Path) -> NDArray[np.uint8]:
    """Colours (H, W, 3) of a picture; grey ones get three equal channels.

    Raises:
        BopFormatError: where it is no readable image.
    """
    return np.asarray(decoded(path, path.name).convert("RGB"), dtype=np.uint8)


def find_color(folder: Path, image_id: int) -> Path | None:
    """The picture of an image, or None."""
    candidates = (folder / kind / f"{image_id:06d}{suffix}" for kind, suffix in COLOR_FILES)
    return next((path for path in candidates if path.is_file()), None)


def decoded(path: Path, name: str) -> Image.Image:
    """An image whose every pixel was decoded, so that a broken file shows here."""
    try:
        with Image.open(path) as image:
            image.load()
            return image
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:  # all broken files
        raise BopFormatError(f"{name} cannot be decoded as an image; replace the file") from error


def decoded_depth(path: Path, name: str) -> Image.Image:
    """The same for a depth image, which must be 16-bit greyscale."""
    image = decoded(path, name)
    if image.mode not in DEPTH_MODES:
        raise BopFormatError(
            f"{name} must be a 16-bit greyscale PNG; its pixels are of kind {image.mode}: save raw depth"
        )
    return image
