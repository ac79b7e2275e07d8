"""Colour images of scenes for fitting: things of all colours, plain or patterned, in some light."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from registration_core.fitting.scenes import FIRST, SETTINGS, Picture
from registration_core.geometry.camera import Intrinsics, depth_to_points

Array = NDArray[np.float64]

ALIKE, ALIKE_BY = 0.25, 0.08
"""Share of things that have nearly the colour of what they stand on, and how nearly."""
PATTERNED = 0.5
"""Share of things with a pattern; ..."""
PATCH = (1.5, 12.0)
"""... of patches of about so many pixels."""
AMBIENT = (0.3, 0.8)
"""Share of the light that comes from everywhere."""
BLUR, NOISE = (0.4, 1.2), (1.0, 6.0)
"""Of the camera: pixels, and levels of 256."""
APART = 2.0
"""Pixels by which colour and depth may lie apart, either way."""


def colored(picture: Picture, rng: np.random.Generator) -> NDArray[np.uint8]:
    """What a colour camera at the place of the depth camera sees of a picture: (H, W, 3)."""
    copies = SETTINGS[picture.setting].copies
    things = picture.labels.copy()
    things[(things > FIRST) & (things < FIRST + copies)] = FIRST  # copies look the same
    ground = rng.uniform(0.1, 0.95, 3)
    image = np.empty((*things.shape, 3))
    for thing in np.unique(things):
        alike = thing < FIRST or rng.random() < ALIKE
        albedo = ground + rng.normal(0.0, ALIKE_BY, 3) if alike else rng.uniform(0.05, 1.0, 3)
        here = things == thing
        image[here] = albedo
        if rng.random() < PATTERNED:
            image[here & _patches(here.shape, rng)] = albedo * rng.uniform(0.3, 1.0, 3)
    image *= 230.0 * _light(picture.depth, picture.camera, rng)[..., None]
    image = ndimage.gaussian_filter(image, (*[rng.uniform(*BLUR)] * 2, 0.0))
    image = ndimage.shift(image, (*rng.uniform(-APART, APART, 2), 0.0), order=1, mode="nearest")
    image += rng.normal(0.0, rng.uniform(*NOISE), image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def _patches(shape: tuple[int, ...], rng: np.random.Generator) -> NDArray[np.bool_]:
    field = ndimage.gaussian_filter(rng.standard_normal(shape, dtype=np.float32), rng.uniform(*PATCH))
    return np.asarray(field > field.std() * rng.uniform(-1.0, 1.0))


def _light(depth: NDArray[np.float32], camera: Intrinsics, rng: np.random.Generator) -> Array:
    """How bright each pixel (H, W) is: Lambert's law under one lamp, and light from everywhere."""
    points = depth_to_points(depth, camera).reshape(*depth.shape, 3)
    normals = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
    normals /= np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), 1e-12)  # towards the camera
    lamp = np.array([*rng.uniform(-1.0, 1.0, 2), -1.0])
    ambient = rng.uniform(*AMBIENT)
    return ambient + (1.0 - ambient) * np.clip(normals @ (lamp / np.linalg.norm(lamp)), 0.0, 1.0)
