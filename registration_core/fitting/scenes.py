"""Scenes for fitting: known objects on tables, in clutter, in bins and alone, some of them more than once."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import trimesh
from numpy.typing import NDArray

from registration_core.geometry import pose
from registration_core.geometry.camera import Intrinsics
from registration_core.geometry.object_model import ObjectModel
from registration_core.rendering.rasterizer import render_depth
from registration_core.synthetic.objects import random_distractor
from registration_core.synthetic.scene import Silhouette, table_model
from registration_core.synthetic.tabletop import Layout, Placed, cameras_around, place

Array = NDArray[np.float64]
DepthImage = NDArray[np.float32]


@dataclass(frozen=True)
class Setting:
    """A kind of scene."""

    layout: Layout
    objects: int
    """Known objects in it."""
    distractors: int
    copies: int
    """How often the first of them is there."""
    has_walls: bool = False
    """It lies in a bin."""
    is_cut_out: bool = False
    """Only what is measured of the first object is left of the image, as a segmentation leaves it."""


SETTINGS = {
    "table": Setting(Layout(gap=0.002, elevation=(0.4, 1.1), distance=(0.5, 1.2)), 5, 3, 1),
    "clutter": Setting(Layout(radius=0.07, gap=0.0, elevation=(0.25, 0.8), distance=(0.5, 1.2)), 5, 6, 1),
    "bin": Setting(
        Layout(radius=0.08, gap=0.0, upright=0.3, elevation=(1.0, 1.5), distance=(0.4, 0.9)), 4, 1, 3, True
    ),
    "alone": Setting(Layout(elevation=(0.3, 1.3), distance=(0.4, 0.9)), 1, 0, 1),
    "cut out": Setting(Layout(elevation=(0.3, 1.3), distance=(0.4, 0.9)), 1, 0, 1, is_cut_out=True),
}
FIRST = 2
"""Label of the first thing in a picture."""
WALL = 0.01
"""Thickness of a bin's walls, metres."""


@dataclass(frozen=True, eq=False)
class Seen:
    """One object as the camera sees it."""

    index: int
    """Of the known objects of the scene."""
    T_camera_object: Array
    """(4, 4), metres: the truth."""
    visible: float
    """Share in [0, 1] of its silhouette that nothing hides."""


@dataclass(frozen=True, eq=False)
class Picture:
    """A perfect depth image with what is in it."""

    setting: str
    camera: Intrinsics
    depth: DepthImage
    """(H, W), metres, 0 = nothing there."""
    labels: NDArray[np.uint8]
    """(H, W), which thing is seen there: 0 nothing, 1 the table, from FIRST on all else, the known
    objects first and the walls last."""
    seen: tuple[Seen, ...]
    kept: NDArray[np.bool_] | None
    """(H, W), the pixels that are left where the setting cuts the object out; None where all are."""


def random_camera(rng: np.random.Generator) -> Intrinsics:
    """A camera of 640x480 pixels, one in five with a long lens."""
    focal = rng.uniform(900.0, 1080.0) if rng.random() < 0.2 else rng.uniform(520.0, 630.0)
    return Intrinsics(
        width=640, height=480, fx=focal, fy=focal, cx=rng.uniform(310, 330), cy=rng.uniform(230, 250)
    )


def picture(
    setting: str, models: Sequence[ObjectModel], rng: np.random.Generator, farthest: float
) -> Picture:
    """One view of a scene of SETTINGS with as many of the models as it asks for, no farther than this [m]."""
    kind = SETTINGS[setting]
    nearest_way, farthest_way = kind.layout.distance
    layout = replace(kind.layout, distance=(nearest_way, max(nearest_way, min(farthest_way, farthest))))
    indices = [0] * kind.copies + list(range(1, kind.objects - kind.copies + 1))
    things = [models[k] for k in indices] + [random_distractor(rng).model for _ in range(kind.distractors)]
    order = rng.permutation(len(things))
    everything = place([things[k] for k in order], rng, layout)
    placed = [everything[k] for k in np.argsort(order)]
    camera = random_camera(rng)
    T_camera_world = pose.inverse(cameras_around(1, rng, layout)[0])
    silhouettes = [Silhouette.of(thing, camera, T_camera_world) for thing in placed]
    walls = [Placed(wall, np.eye(4)) for wall in bin_walls(placed, rng)] if kind.has_walls else []
    everything_seen = silhouettes + [Silhouette.of(wall, camera, T_camera_world) for wall in walls]
    nearest = render_depth(table_model(), camera, T_camera_world)
    labels = (nearest > 0.0).astype(np.uint8)
    nearest[nearest == 0.0] = np.inf
    for silhouette in everything_seen:
        silhouette.draw_into(nearest)
    for k, silhouette in enumerate(everything_seen):
        silhouette.label_in(labels, nearest, FIRST + min(k, len(silhouettes)))
    seen = tuple(
        Seen(index, T_camera_world @ thing.T_world_object, silhouette.visible_share(nearest))
        for index, thing, silhouette in zip(indices, placed, silhouettes, strict=False)
    )
    perfect = np.where(np.isfinite(nearest), nearest, np.float32(0.0))
    own = render_depth(models[0], camera, seen[0].T_camera_object) > 0 if kind.is_cut_out else None
    return Picture(setting, camera, perfect, labels, seen, own)


def bin_walls(placed: Sequence[Placed], rng: np.random.Generator) -> list[ObjectModel]:
    """Four walls about everything that was placed."""
    corners = np.concatenate([pose.apply(thing.T_world_object, thing.model.vertices) for thing in placed])
    low, high = corners.min(axis=0)[:2] - 0.015, corners.max(axis=0)[:2] + 0.015
    height = rng.uniform(0.04, 0.12)
    middle, size = (low + high) / 2.0, high - low
    walls = []
    for axis in range(2):
        for side in (low[axis], high[axis]):
            extents = np.array([WALL, WALL, height])
            extents[1 - axis] = size[1 - axis] + 2 * WALL
            box = trimesh.creation.box(extents)
            centre = np.array([*middle, height / 2.0])
            centre[axis] = side
            box.apply_translation(centre)
            walls.append(ObjectModel(np.asarray(box.vertices), np.asarray(box.faces, dtype=np.int32)))
    return walls
