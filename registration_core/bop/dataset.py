"""BOP datasets: read and checked as a whole. Millimetres and `cam_R_m2c` end in the modules named `bop`."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from registration_core.bop.fields import BopFormatError, Entry, name_of, optional_json, read_json, shortened
from registration_core.bop.images import (
    ImageFile,
    SceneFolders,
    examined_color,
    examined_depth,
    read_color,
    read_depth,
)
from registration_core.bop.layout import find_scene_folders
from registration_core.bop.models import BopObject, find_meshes, read_objects
from registration_core.geometry.camera import Intrinsics

__all__ = [
    "BopDataset",
    "BopFormatError",
    "BopGroundTruth",
    "BopImage",
    "BopObject",
    "BopScene",
    "read_color",
    "read_dataset",
    "read_depth",
]

Progress = Callable[[float, str], None]
"""Called with the share done, 0 to 1, and what is being read."""


@dataclass(frozen=True, eq=False)
class BopGroundTruth:
    """The annotated pose of one object instance in one image."""

    obj_id: int
    T_camera_object: NDArray[np.float64]
    """(4, 4), metres."""


@dataclass(frozen=True, eq=False)
class BopImage:
    """A depth image with its camera, and colour where there is any."""

    image_id: int
    color: ImageFile | None
    depth: ImageFile
    depth_scale: float
    """Raw depth times this is millimetres."""
    camera: Intrinsics
    T_world_camera: NDArray[np.float64] | None
    """(4, 4), metres; None where the dataset does not say."""
    ground_truth: tuple[BopGroundTruth, ...] | None
    """None where the image is not annotated."""


@dataclass(frozen=True)
class BopScene:
    """Images of one scene."""

    scene_id: int
    split: str
    """Name of the folder that holds it, such as "test"."""
    images: tuple[BopImage, ...]


@dataclass(frozen=True)
class BopDataset:
    """Everything a dataset holds, checked."""

    name: str
    objects: tuple[BopObject, ...]
    scenes: tuple[BopScene, ...]


def read_dataset(root: Path, progress: Progress | None = None) -> BopDataset:
    """Read a BOP dataset in its scene-wise layout and check every file of it, decoding each image.

    Raises:
        BopFormatError: at the first thing that is wrong, in one sentence.
    """
    if not root.is_dir():
        raise BopFormatError(f"{root} is no folder; give the folder of a BOP dataset")
    mesh_paths = find_meshes(root)
    folders = find_scene_folders(root)
    cameras = [
        read_json(folder / "scene_camera.json", name_of(folder / "scene_camera.json", root))
        for folder in folders
    ]
    report = StepCounter(len(mesh_paths) + sum(map(len, cameras)), progress)
    objects = read_objects(root, mesh_paths, report.done)
    known = {known_object.obj_id for known_object in objects}
    scenes = [read_scene(root, *pair, known, report) for pair in zip(folders, cameras, strict=True)]
    return BopDataset(root.resolve().name, objects, tuple(scenes))


def with_depth_scale(dataset: BopDataset, depth_scale: float) -> BopDataset:
    """The dataset as if every image had this scale: raw depth times it is millimetres."""
    scenes = [
        replace(scene, images=tuple(replace(image, depth_scale=depth_scale) for image in scene.images))
        for scene in dataset.scenes
    ]
    return replace(dataset, scenes=tuple(scenes))


class StepCounter:
    """Turns steps of equal weight into calls of a progress function."""

    def __init__(self, steps: int, progress: Progress | None) -> None:
        self._steps = steps
        self._done = 0
        self._progress = progress

    def done(self, what: str) -> None:
        """One more step is done."""
        self._done += 1
        if self._progress is not None:
            self._progress(self._done / self._steps, what)


def read_scene(
    root: Path, folder: Path, cameras: dict[int, Any], known: set[int], report: StepCounter
) -> BopScene:
    """One scene; `cameras` is the content of its `scene_camera.json`, `known` the ids that have a mesh."""
    name = name_of(folder, root)
    if not cameras:
        raise BopFormatError(f"{name}/scene_camera.json names no image; add one entry an image")
    truths = optional_json(folder / "scene_gt.json", root)
    for image_id in sorted(set(truths) - set(cameras)):
        raise BopFormatError(
            f"{name}/scene_gt.json: image {image_id} is not in scene_camera.json; add it there"
        )
    files = SceneFolders(folder, name)

    def read(image_id: int) -> BopImage:
        truth = None
        if image_id in truths:
            truth = read_ground_truth(truths[image_id], f"{name}/scene_gt.json: image {image_id}", known)
        entry = Entry.of(cameras[image_id], f"{name}/scene_camera.json: image {image_id}")
        return read_image(name, files, image_id, entry, truth)

    images = []
    pool = ThreadPoolExecutor()  # decoding, which takes the time, lets other threads run
    try:
        for image in pool.map(read, sorted(cameras)):
            images.append(image)
            report.done(f"{name}, image {image.image_id}")
    finally:
        pool.shutdown(cancel_futures=True)
    return BopScene(int(folder.name), folder.parent.name, tuple(images))


def read_ground_truth(content: object, where: str, known: set[int]) -> tuple[BopGroundTruth, ...]:
    """The annotations of one image."""
    if not isinstance(content, list):
        raise BopFormatError(f"{where} must be a list [...]; it is {shortened(content)}")
    truths = []
    for index, value in enumerate(content):
        entry = Entry.of(value, f"{where}, entry {index}")
        obj_id = entry.whole("obj_id")
        if obj_id not in known:
            raise BopFormatError(
                f"{entry.where}: obj_id {obj_id} is unknown; add models/obj_{obj_id:06d}.ply or correct it"
            )
        truths.append(BopGroundTruth(obj_id, entry.object_pose()))
    return tuple(truths)


def read_image(
    scene: str, files: SceneFolders, image_id: int, entry: Entry, truth: tuple[BopGroundTruth, ...] | None
) -> BopImage:
    """One image: both files are decoded and must have the same size; `scene` names it in messages."""
    depth_scale = entry.positive("depth_scale", "raw depth times it is millimetres")
    K = entry.numbers("cam_K", 9)
    depth_path = files.depth(image_id)
    if depth_path is None:
        raise BopFormatError(
            f"{scene}/depth/{image_id:06d}.png is missing though scene_camera.json names image {image_id};"
            " add the file"
        )
    depth = examined_depth(depth_path, f"{scene}/depth/{depth_path.name}")
    color_path, color = files.color(image_id), None
    if color_path is not None:
        color_name = f"{scene}/{color_path.parent.name}/{color_path.name}"
        color = examined_color(color_path, color_name, (depth.width, depth.height))
        if (color.width, color.height) != (depth.width, depth.height):
            raise BopFormatError(
                f"{color_name} is {color.width}x{color.height} pixels but its depth image is"
                f" {depth.width}x{depth.height}; both must have one size"
            )
    try:
        camera = Intrinsics.from_matrix(K, depth.width, depth.height)
    except ValueError as error:
        raise BopFormatError(f"{entry.where}: cam_K: {error}") from error
    return BopImage(image_id, color, depth, depth_scale, camera, entry.camera_pose(), truth)
