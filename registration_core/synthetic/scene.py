"""Tabletop scenes in memory: perfect and measured depth, true poses, and how much of each object shows."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import trimesh
from numpy.typing import NDArray

from registration_core.geometry import pose
from registration_core.geometry.camera import Intrinsics, project
from registration_core.geometry.object_model import ObjectModel
from registration_core.rendering.rasterizer import render_depth
from registration_core.synthetic.objects import ProceduralObject, random_distractor
from registration_core.synthetic.sensor_families import DEMO, SensorFamily, draw_sensor
from registration_core.synthetic.sensors import measure
from registration_core.synthetic.tabletop import Layout, Placed, cameras_around, place

Array = NDArray[np.float64]
DepthImage = NDArray[np.float32]
Pixel = TypeVar("Pixel", np.float32, np.uint8)

CAMERA = Intrinsics(width=640, height=480, fx=570.0, fy=570.0, cx=319.5, cy=239.5)
"""A PrimeSense's camera."""

TABLE_SIZE, TABLE_THICKNESS = 1.2, 0.04
"""Metres."""

LAYOUT = Layout()


@dataclass(frozen=True, eq=False)
class Instance:
    """One object as one view shows it."""

    T_camera_object: Array
    """(4, 4), metres: the truth."""
    visible: float
    """Share in [0, 1] of its silhouette, counted also outside of the image, that nothing hides."""


@dataclass(frozen=True, eq=False)
class View:
    """What a camera sees."""

    camera: Intrinsics
    T_world_camera: Array
    """(4, 4), metres."""
    perfect_depth: DepthImage
    """(H, W), metres, 0 = nothing there."""
    depth: DepthImage
    """The same as the sensor measures it."""
    instances: tuple[Instance, ...]
    """One for each of the scene's objects, in their order."""


@dataclass(frozen=True, eq=False)
class Scene:
    """Things on a table, and views of them."""

    objects: tuple[Placed, ...]
    """Whose poses are to be found, in the order they were asked for."""
    distractors: tuple[tuple[ProceduralObject, Array], ...]
    """What else stands there, with `T_world_object` (4, 4)."""
    views: tuple[View, ...]


def make_scene(
    rng: np.random.Generator,
    objects: Sequence[ObjectModel],
    distractors: int = 4,
    views: int = 1,
    camera: Intrinsics = CAMERA,
    layout: Layout = LAYOUT,
    family: SensorFamily = DEMO,
) -> Scene:
    """Put the objects and some unknown things on a table at random, and look at them from several sides.

    Args:
        rng: decides everything; the same state gives the same scene.
        objects: whose poses are to be found, metres, z up as they stand.
        distractors: number of unknown things; more of them hide more.
        views: number of cameras around the table.
        camera: of every view.
        layout: how crowded the table is, and where the cameras stand.
        family: the kind of sensor; what it does wrong is drawn anew for each view.
    """
    unknown = [random_distractor(rng) for _ in range(distractors)]
    order = rng.permutation(len(objects) + distractors)  # the middle is not for the objects alone
    models = [*objects, *(thing.model for thing in unknown)]
    everything = place([models[k] for k in order], rng, layout)
    placed = [everything[k] for k in np.argsort(order)]
    known, others = placed[: len(objects)], placed[len(objects) :]
    return Scene(
        tuple(known),
        tuple((thing, where.T_world_object) for thing, where in zip(unknown, others, strict=True)),
        tuple(
            make_view(rng, known, others, camera, T_world_camera, family)
            for T_world_camera in cameras_around(views, rng, layout)
        ),
    )


def make_view(
    rng: np.random.Generator,
    objects: Sequence[Placed],
    others: Sequence[Placed],
    camera: Intrinsics,
    T_world_camera: Array,
    family: SensorFamily,
) -> View:
    """Depth of everything on the table and, for each object, how much of it shows."""
    T_camera_world = pose.inverse(T_world_camera)
    silhouettes = [Silhouette.of(thing, camera, T_camera_world) for thing in (*objects, *others)]
    nearest = render_depth(table_model(), camera, T_camera_world)
    nearest[nearest == 0.0] = np.inf
    for silhouette in silhouettes:
        silhouette.draw_into(nearest)
    instances = tuple(
        Instance(T_camera_world @ thing.T_world_object, silhouette.visible_share(nearest))
        for thing, silhouette in zip(objects, silhouettes[: len(objects)], strict=True)
    )
    perfect = np.where(np.isfinite(nearest), nearest, np.float32(0.0))
    measured = measure(perfect, camera, rng, draw_sensor(family, rng))
    return View(camera, T_world_camera, perfect, measured, instances)


@dataclass(frozen=True, eq=False)
class Silhouette:
    """One thing's depth, cut out around it; the part may reach outside of the image."""

    depth: DepthImage
    """(h, w), metres, infinite where the thing is not."""
    left: int
    top: int

    @classmethod
    def of(cls, thing: Placed, camera: Intrinsics, T_camera_world: Array) -> "Silhouette":
        """Render just the rectangle that holds the thing."""
        T_camera_object = T_camera_world @ thing.T_world_object
        pixels = project(pose.apply(T_camera_object, thing.model.vertices), camera)
        left, top = np.floor(pixels.min(axis=0)).astype(int).tolist()
        right, bottom = np.ceil(pixels.max(axis=0)).astype(int).tolist()
        part = camera.cropped(left, top, right - left + 1, bottom - top + 1)
        depth = render_depth(thing.model, part, T_camera_object)
        depth[depth == 0.0] = np.inf
        return cls(depth, left, top)

    def draw_into(self, nearest: DepthImage) -> None:
        """Lower `nearest` (H, W) to this depth where it is smaller."""
        image, part = self._overlap(nearest)
        np.minimum(image, part, out=image)

    def visible_share(self, nearest: DepthImage) -> float:
        """Share of the silhouette that is the nearest surface."""
        image, part = self._overlap(nearest)
        shown = int((np.isfinite(part) & (part <= image)).sum())
        return shown / max(1, int(np.isfinite(self.depth).sum()))

    def label_in(self, labels: NDArray[np.uint8], nearest: DepthImage, label: int) -> None:
        """Write `label` into `labels` (H, W) where this is the nearest surface."""
        image, part = self._overlap(nearest)
        self._overlap(labels)[0][np.isfinite(part) & (part <= image)] = label

    def _overlap(self, image: NDArray[Pixel]) -> tuple[NDArray[Pixel], DepthImage]:
        """The parts of an image (H, W) and of this depth that lie on each other."""
        height, width = self.depth.shape
        rows, columns = _within(self.top, height, image.shape[0]), _within(self.left, width, image.shape[1])
        part = self.depth[
            rows.start - self.top : rows.stop - self.top,
            columns.start - self.left : columns.stop - self.left,
        ]
        return image[rows, columns], part


def _within(first: int, count: int, size: int) -> slice:
    """The indices of `first`, ..., `first + count - 1` that lie in 0, ..., `size - 1`; empty where none
    does.
    """
    start = max(0, first)
    return slice(start, max(start, min(size, first + count)))


def table_model() -> ObjectModel:
    """The table top."""
    mesh = trimesh.creation.box((TABLE_SIZE, TABLE_SIZE, TABLE_THICKNESS))
    mesh.apply_translation((0.0, 0.0, -TABLE_THICKNESS / 2.0))
    return ObjectModel(np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int32))
