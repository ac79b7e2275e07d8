"""What a dataset's scenes become: rigid worlds, and in each a task for every copy of an object."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from app.datasets.start_pose import start_pose
from registration_core import ObjectModel
from registration_core.bop.dataset import BopGroundTruth, BopImage, BopScene, read_depth
from registration_core.geometry import pose

Array = NDArray[np.float64]

NOISE = 0.01
"""Metres by which annotations of one copy in two images may lie apart, beside half of its least extent: a
copy that lies farther off is another one."""
FAR = 1e6
"""Metres; what no two things are apart."""


@dataclass(frozen=True)
class World:
    """Images that share one rigid world, and the label of the scene that they become."""

    source: BopScene
    label: str
    images: tuple[BopImage, ...]
    tasks: tuple["PlannedTask", ...]


@dataclass(frozen=True)
class PlannedTask:
    """One copy of an object, to be registered from the first image that shows it on."""

    obj_id: int
    instance: int
    image_id: int
    T_world_object_start: Array
    T_world_object_reference: Array


@dataclass(eq=False)
class Copies:
    """The copies of one object in a world, as far as they were met."""

    model: ObjectModel
    poses: list[Array] = field(default_factory=list)
    """T_world_object (4, 4) of each, as it was first annotated."""

    def meet(self, annotated: list[Array]) -> list[int]:
        """Which copy each of an image's annotations (T_world_object) is of; new ones join the others."""
        found = {row: column for row, column in self._pairs(annotated)}
        for row, T_world_object in enumerate(annotated):
            if row not in found:
                found[row] = len(self.poses)
                self.poses.append(T_world_object)
        return [found[row] for row in range(len(annotated))]

    def _pairs(self, annotated: list[Array]) -> list[tuple[int, int]]:
        """Annotations and the known copies that they are of, each of one at most, the nearest in all."""
        if not self.poses or not annotated:
            return []
        apart = cdist(self._centres(annotated), self._centres(self.poses))
        is_same = apart <= self._reach
        rows, columns = linear_sum_assignment(np.where(is_same, apart, FAR))
        return [(row, column) for row, column in zip(rows, columns, strict=True) if is_same[row, column]]

    def _centres(self, poses: list[Array]) -> Array:
        return np.stack([pose.apply(T, self.model.centre) for T in poses])

    @property
    def _reach(self) -> float:
        extents = np.ptp(self.model.vertices, axis=0)
        return float(extents.min()) / 2 + NOISE


def worlds_of(scene: BopScene, models: dict[int, ObjectModel]) -> list[World]:
    """The rigid worlds in a BOP scene: all posed images together, each other image by itself."""
    posed = tuple(image for image in scene.images if image.T_world_camera is not None)
    groups = [(f"scene {scene.scene_id}", posed)] if posed else []
    for image in scene.images:
        if image.T_world_camera is None:
            groups.append((f"scene {scene.scene_id} › frame {image.image_id}", (image,)))
    return [World(scene, label, images, _planned_tasks(images, models)) for label, images in groups]


def copies_by_image(
    images: tuple[BopImage, ...], models: dict[int, ObjectModel]
) -> list[list[tuple[BopGroundTruth, int]]]:
    """For each image of one world its annotations, each with the number of the copy that it is of.

    Copies are told apart by where they are in the world: an image lists what it shows, in any order.
    """
    copies = {obj_id: Copies(model) for obj_id, model in models.items()}
    numbered = []
    for image in images:
        found: list[tuple[BopGroundTruth, int]] = []
        truths = image.ground_truth or ()
        for obj_id in dict.fromkeys(truth.obj_id for truth in truths):
            alike = [truth for truth in truths if truth.obj_id == obj_id]
            poses = [world_pose(image, truth) for truth in alike]
            found += zip(alike, copies[obj_id].meet(poses), strict=True)
        numbered.append(found)
    return numbered


def world_pose(image: BopImage, truth: BopGroundTruth) -> Array:
    """T_world_object (4, 4) of an annotation; the world is the camera's where its pose is not known."""
    return or_identity(image.T_world_camera) @ truth.T_camera_object


def or_identity(T_world_camera: Array | None) -> Array:
    """The camera's pose (4, 4) in its world."""
    return np.eye(4) if T_world_camera is None else T_world_camera


def _planned_tasks(images: tuple[BopImage, ...], models: dict[int, ObjectModel]) -> tuple[PlannedTask, ...]:
    """A task for each copy, in the order in which they are met."""
    planned: dict[tuple[int, int], PlannedTask] = {}
    for image, numbered in zip(images, copies_by_image(images, models), strict=True):
        new = [(truth, copy) for truth, copy in numbered if (truth.obj_id, copy) not in planned]
        if not new:
            continue
        depth = read_depth(image.depth.path, image.depth_scale)
        for truth, copy in new:
            start = start_pose(models[truth.obj_id], depth, image.camera, or_identity(image.T_world_camera))
            planned[truth.obj_id, copy] = PlannedTask(
                truth.obj_id, copy, image.image_id, start, world_pose(image, truth)
            )
    return tuple(planned.values())
