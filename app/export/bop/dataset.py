"""Writes the selected part of the database as a BOP dataset, scene by scene and image by image."""

import json
import shutil
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from app.export.bop.coco import CocoScene
from app.export.bop.dataset_info import dataset_info
from app.export.bop.models import load_model, write_models
from app.export.content.selection import Annotation, ExportImage, ExportObject, ExportScene, Selection
from app.export.content.visibility import Mask, appearance, is_before_camera
from app.storage.files import FileStore
from registration_core import ObjectModel
from registration_core.bop.dataset import read_depth
from registration_core.bop.images import JPEG_FORMATS, is_grey
from registration_core.bop.writer import camera_entry, camera_file, gt_entry, write_image, write_json
from registration_core.geometry import pose

Progress = Callable[[float, str], None]
"""Called with the share done, 0 to 1, and what is being done."""

LEAST_VISIBLE_TARGET = 0.1
"""Share of an instance that must be visible to make it a target of the BOP challenge."""


class ModelCache:
    """The models of a dataset's objects, each loaded when it is first asked for."""

    def __init__(self, files: FileStore, objects: tuple[ExportObject, ...]) -> None:
        self._files = files
        self._objects = {found.obj_id: found for found in objects}
        self._models: dict[int, ObjectModel] = {}

    def __getitem__(self, obj_id: int) -> ObjectModel:
        """The model of an object."""
        if obj_id not in self._models:
            self._models[obj_id] = load_model(self._files, self._objects[obj_id])
        return self._models[obj_id]


def write_dataset(selection: Selection, files: FileStore, folder: Path, progress: Progress) -> None:
    """Write the dataset into a new folder; the interaction log is not part of it."""
    folder.mkdir(parents=True)
    progress(0.0, "writing models")
    write_models(folder, selection.objects, files)
    first = selection.scenes[0].images[0]
    write_json(folder / "camera.json", camera_file(first.camera, first.depth_scale))
    (folder / "dataset_info.md").write_text(dataset_info(selection), encoding="utf-8")
    models = ModelCache(files, selection.objects)
    targets: list[dict[str, int]] = []
    done, total = 0, sum(len(scene.images) for scene in selection.scenes)
    for scene in selection.scenes:
        writer = SceneWriter(selection, scene, folder / scene.folder, files, models)
        for image in scene.images:
            progress(done / total, f"writing {scene.folder}, image {image.image_id}")
            writer.write_image(image)
            done += 1
        targets += writer.finish()
    write_targets(folder / "test_targets_bop19.json", targets)


class SceneWriter:
    """Writes one scene folder, an image at a time; `finish` writes the files about all of them."""

    def __init__(
        self,
        selection: Selection,
        scene: ExportScene,
        folder: Path,
        files: FileStore,
        models: ModelCache,
    ) -> None:
        self._scene = scene
        self._folder = folder
        self._files = files
        self._models = models
        self._cameras: dict[int, Any] = {}
        self._truths: dict[int, list[Any]] = {}
        self._infos: dict[int, list[Any]] = {}
        self._color_folder = color_folder(scene, files)
        self._coco = CocoScene(
            selection.name,
            scene.split,
            selection.newest_submission.isoformat(),
            [found.obj_id for found in selection.objects],
        )

    def write_image(self, image: ExportImage) -> None:
        """Write an image's files and note its entries."""
        depth_path = self._files.path(image.depth_hash)
        copy_file(depth_path, self._folder / "depth" / f"{image.image_id:06d}.png")
        file_name = self._write_color(image)
        self._coco.add_image(image.image_id, file_name, image.camera.width, image.camera.height)
        self._cameras[image.image_id] = camera_entry(
            image.camera, image.depth_scale, image.T_world_camera if image.posed else None
        )
        self._truths[image.image_id] = []
        self._infos[image.image_id] = []
        depth = read_depth(depth_path, image.depth_scale)
        for annotation in image.annotations:
            self._write_instance(image, annotation, depth)

    def _write_color(self, image: ExportImage) -> str:
        """Write the picture, where there is one, and return its name in the scene folder."""
        if image.color_hash is None:
            return f"depth/{image.image_id:06d}.png"
        source = self._files.path(image.color_hash)
        with Image.open(source) as picture:
            suffix = ".jpg" if picture.format in JPEG_FORMATS else ".png"
        file_name = f"{self._color_folder}/{image.image_id:06d}{suffix}"
        copy_file(source, self._folder / file_name)
        return file_name

    def _write_instance(self, image: ExportImage, annotation: Annotation, depth: NDArray[np.float32]) -> None:
        """Write an instance's masks and note its entries; one wholly behind the camera has none."""
        model = self._models[annotation.obj_id]
        T_camera_object = pose.inverse(image.T_world_camera) @ annotation.T_world_object
        if not is_before_camera(model, T_camera_object):
            return
        truths = self._truths[image.image_id]
        shown = appearance(model, depth, image.camera, T_camera_object)
        file_name = f"{image.image_id:06d}_{len(truths):06d}.png"
        write_mask(self._folder / "mask" / file_name, shown.mask)
        write_mask(self._folder / "mask_visib" / file_name, shown.mask_visib)
        truths.append(gt_entry(annotation.obj_id, T_camera_object))
        self._infos[image.image_id].append(shown.info)
        self._coco.add_instance(
            image.image_id, annotation.obj_id, shown.mask, shown.mask_visib, shown.info["visib_fract"]
        )

    def finish(self) -> list[dict[str, int]]:
        """Write the scene's JSON files and return its test targets."""
        write_json(self._folder / "scene_camera.json", self._cameras)
        write_json(self._folder / "scene_gt.json", self._truths)
        write_json(self._folder / "scene_gt_info.json", self._infos)
        write_json(self._folder / "scene_gt_coco.json", self._coco.content())
        return self._targets() if self._scene.split.startswith("test") else []

    def _targets(self) -> list[dict[str, int]]:
        """How many instances of which object are to be found in which image."""
        targets = []
        for image_id, truths in self._truths.items():
            counts = Counter(
                truth["obj_id"]
                for truth, info in zip(truths, self._infos[image_id], strict=True)
                if info["visib_fract"] >= LEAST_VISIBLE_TARGET
            )
            targets += [
                {
                    "im_id": image_id,
                    "inst_count": count,
                    "obj_id": obj_id,
                    "scene_id": self._scene.scene_id,
                }
                for obj_id, count in sorted(counts.items())
            ]
        return targets


def color_folder(scene: ExportScene, files: FileStore) -> str:
    """Where a scene's pictures go, all of them together: to `gray` only where each of them is grey."""
    for image in scene.images:
        if image.color_hash is not None:
            with Image.open(files.path(image.color_hash)) as picture:
                if not is_grey(picture):
                    return "rgb"
    return "gray"


def copy_file(source: Path, target: Path) -> None:
    """Copy a stored file, and make the folder where it is missing."""
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, target)


def write_mask(path: Path, mask: Mask) -> None:
    """Write a mask (H, W) as an 8-bit PNG: 255 inside, 0 outside."""
    write_image(path, Image.fromarray(mask.astype(np.uint8) * np.uint8(255)))


def write_targets(path: Path, targets: list[dict[str, int]]) -> None:
    """Write a list of test targets, one a line."""
    path.write_text("[\n" + ",\n".join(map(json.dumps, targets)) + "\n]\n", encoding="utf-8")
