"""The gate: an export is served only after it was read back and found right.

Nothing here calls the code that writes exports: files are read anew and poses rendered by another renderer.
"""

import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.export.content.selection import Selection
from app.export.gate.instance import GateError, Instance, MisplacedError, check_instance, read_mask
from app.export.gate.raycasting import RayCaster
from app.export.gate.strict_ply import read_triangles
from registration_core.bop.dataset import (
    BopDataset,
    BopFormatError,
    BopImage,
    BopScene,
    read_dataset,
    read_depth,
)
from registration_core.bop.fields import METRES_PER_MILLIMETRE
from registration_core.geometry import pose

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

NEAR = 0.01
"""Metres; an object that does not reach beyond has no place in an image."""

POSE_TOLERANCE = 1e-5
"""Metres and radians: what rounding may change."""

READING_SHARE = 0.3
"""Part of the gate's time that reading takes."""


class ExpectedObject(NamedTuple):
    """What the database knows of an object instance."""

    registration_id: int
    obj_id: int
    T_world_object: Array
    """(4, 4), metres."""


@dataclass(frozen=True)
class Failure:
    """An object instance that did not pass, in the first image that shows it."""

    registration_id: int
    split: str
    scene_id: int
    image_id: int
    where: str
    """The place in words."""
    reason: str
    """A sentence without it."""


class ObjectsError(GateError):
    """Everything is right but for some objects, which the rest does not depend on."""

    def __init__(self, failures: Sequence[Failure]) -> None:
        self.failures = tuple(failures)
        first = self.failures[0]
        others = f" (and {len(failures) - 1} more)" if len(failures) > 1 else ""
        super().__init__(f"{first.where}: {first.reason}{others}")


@dataclass(frozen=True, eq=False)
class ExpectedImage:
    """What the database knows of an image."""

    T_world_camera: Array | None
    """(4, 4), metres; None where the world is the camera."""
    objects: tuple["ExpectedObject", ...]
    """Its annotations, in order."""


Expected = Mapping[tuple[str, int, int], ExpectedImage]
"""By split, scene id and image id."""


def expected_images(selection: Selection) -> Expected:
    """What an export of this selection must hold."""
    return {
        (scene.split, scene.scene_id, image.image_id): ExpectedImage(
            image.T_world_camera if image.posed else None,
            tuple(
                ExpectedObject(found.registration_id, found.obj_id, found.T_world_object)
                for found in image.annotations
            ),
        )
        for scene in selection.scenes
        for image in scene.images
    }


def check_export(root: Path, expected: Expected, progress: Progress) -> None:
    """Read a dataset folder back and compare it with the database and with a new rendering of every pose.

    Raises:
        ObjectsError: where all is right but for some objects.
        GateError: at the first thing else that is wrong, in a sentence that names scene, image and object.
    """
    try:
        dataset = read_dataset(root, lambda share, what: progress(READING_SHARE * share, f"reading {what}"))
    except BopFormatError as error:
        raise GateError(str(error)) from error
    check_images(dataset, expected)
    check_models(root, dataset)
    caster = RayCaster(dataset.objects)
    failures: dict[int, Failure] = {}
    done = 0
    for scene in dataset.scenes:
        check = SceneCheck(root, scene, caster)
        for image in scene.images:
            share = READING_SHARE + (1.0 - READING_SHARE) * done / len(expected)
            progress(share, f"checking {check.name}, image {image.image_id}")
            for failure in check.image(image, expected[scene.split, scene.scene_id, image.image_id]):
                failures.setdefault(failure.registration_id, failure)
            done += 1
        check.mask_files()
    check_targets(root, dataset)
    if failures:
        raise ObjectsError(list(failures.values()))


def check_images(dataset: BopDataset, expected: Expected) -> None:
    """Raise where an image is missing or too many."""
    found = {
        (scene.split, scene.scene_id, image.image_id) for scene in dataset.scenes for image in scene.images
    }
    for split, scene_id, image_id in sorted(found ^ set(expected)):
        what = "is missing" if (split, scene_id, image_id) in expected else "is not of the exported dataset"
        raise GateError(f"{split}/{scene_id:06d}, image {image_id} {what}")


def check_models(root: Path, dataset: BopDataset) -> None:
    """Raise where an object is missing, or the strictest readers cannot read its mesh."""
    infos = load_json(root / "models" / "models_info.json")
    for found in dataset.objects:
        if str(found.obj_id) not in infos:
            raise GateError(f"models/models_info.json: object {found.obj_id} is missing")
        corners = {}
        for folder in ("models", "models_eval"):
            corners[folder] = mesh_triangles(root / folder / found.mesh_path.name, found.obj_id)
        expected = found.model.vertices[found.model.faces] / METRES_PER_MILLIMETRE
        read = corners["models"]
        if read.shape != expected.shape or not np.allclose(read, expected, rtol=1e-5, atol=1e-3):
            raise GateError(f"models/{found.mesh_path.name} does not hold the triangles of its object")


def mesh_triangles(path: Path, obj_id: int) -> Array:
    """The triangles (F, 3, 3) of an object's mesh file, mm; raise where it is missing or not plain."""
    name = f"{path.parent.name}/{path.name} of object {obj_id}"
    try:
        return read_triangles(path)
    except FileNotFoundError as error:
        raise GateError(f"{name} is missing") from error
    except ValueError as error:
        raise GateError(f"{name}: {error}") from error


def check_targets(root: Path, dataset: BopDataset) -> None:
    """Raise where a test target asks for more instances than an image of a test split has."""
    counts = Counter(
        (scene.scene_id, image.image_id, truth.obj_id)
        for scene in dataset.scenes
        if scene.split.startswith("test")
        for image in scene.images
        for truth in image.ground_truth or ()
    )
    for target in load_json(root / "test_targets_bop19.json"):
        key = (target["scene_id"], target["im_id"], target["obj_id"])
        if target["inst_count"] > counts[key]:
            raise GateError(
                f"test_targets_bop19.json: scene {key[0]}, image {key[1]}, object {key[2]}:"
                f" {target['inst_count']} instances asked for, {counts[key]} there"
            )


class SceneCheck:
    """Checks one scene folder, an image at a time."""

    def __init__(self, root: Path, scene: BopScene, caster: RayCaster) -> None:
        self._scene = scene
        self.name = f"{scene.split}/{scene.scene_id:06d}"
        self._folder = root / self.name
        self._caster = caster
        self._infos = load_json(self._folder / "scene_gt_info.json")
        self._coco: dict[int, list[dict[str, Any]]] = {}
        for annotation in load_json(self._folder / "scene_gt_coco.json")["annotations"]:
            self._coco.setdefault(annotation["image_id"], []).append(annotation)
        self._mask_names: set[str] = set()

    def image(self, image: BopImage, expected: ExpectedImage) -> list[Failure]:
        """Check an image's camera, annotations and masks; returns the objects that do not pass."""
        where = f"{self.name}, image {image.image_id}"
        check_camera(image, expected, where)
        wanted = self._check_truths(image, expected, where)
        truths = image.ground_truth or ()
        infos = self._infos.get(str(image.image_id), [])
        if len(infos) != len(truths):
            raise GateError(
                f"{where}: scene_gt_info.json has {len(infos)} entries, scene_gt.json {len(truths)}"
            )
        depth = read_depth(image.depth.path, image.depth_scale)
        coco = iter(self._coco.get(image.image_id, []))
        failures = []
        for index, (truth, info) in enumerate(zip(truths, infos, strict=True)):
            instance_name = f"{where}, object {truth.obj_id} (entry {index})"
            file_name = f"{image.image_id:06d}_{index:06d}.png"
            self._mask_names.add(file_name)
            instance = Instance(
                instance_name,
                truth.obj_id,
                read_mask(self._folder / "mask" / file_name, depth.shape, instance_name),
                read_mask(self._folder / "mask_visib" / file_name, depth.shape, instance_name),
                info,
                next(coco, None) if info["px_count_visib"] else None,
            )
            try:
                check_instance(instance, self._caster, image.camera, truth.T_camera_object, depth)
            except MisplacedError as error:
                failures.append(
                    Failure(
                        wanted[index].registration_id,
                        self._scene.split,
                        self._scene.scene_id,
                        image.image_id,
                        instance_name,
                        error.reason,
                    )
                )
        if next(coco, None) is not None:
            raise GateError(f"{where}: scene_gt_coco.json has more instances than are visible")
        return failures

    def _check_truths(self, image: BopImage, expected: ExpectedImage, where: str) -> list[ExpectedObject]:
        """The database's annotations that are in the image; raise where the file's are others."""
        T_world_camera = np.eye(4) if image.T_world_camera is None else image.T_world_camera
        T_camera_world = pose.inverse(T_world_camera)
        wanted = [
            found
            for found in expected.objects
            if self._caster.nearest_and_farthest(found.obj_id, T_camera_world @ found.T_world_object)[1]
            > NEAR
        ]
        truths = image.ground_truth or ()
        if len(truths) != len(wanted):
            raise GateError(f"{where}: scene_gt.json has {len(truths)} objects, the database {len(wanted)}")
        for index, (truth, found) in enumerate(zip(truths, wanted, strict=True)):
            entry = f"{where}, object {truth.obj_id} (entry {index})"
            if truth.obj_id != found.obj_id:
                raise GateError(f"{entry}: obj_id is {truth.obj_id}, in the database {found.obj_id}")
            T_camera_object = T_camera_world @ found.T_world_object
            check_pose(truth.T_camera_object, T_camera_object, f"{entry}: cam_R_m2c and cam_t_m2c")
        return wanted

    def mask_files(self) -> None:
        """Raise where there is a mask without an annotation; called after the last image."""
        for kind in ("mask", "mask_visib"):
            for path in sorted((self._folder / kind).glob("*")):
                if path.name not in self._mask_names:
                    raise GateError(f"{self.name}/{kind}/{path.name} belongs to no entry of scene_gt.json")


def check_camera(image: BopImage, expected: ExpectedImage, where: str) -> None:
    """Raise where the camera's pose is not the database's."""
    found = image.T_world_camera
    if found is None or expected.T_world_camera is None:
        if found is not expected.T_world_camera:
            raise GateError(
                f"{where}: cam_R_w2c and cam_t_w2c must be written just where the camera's pose is known"
            )
        return
    check_pose(
        pose.inverse(found), pose.inverse(expected.T_world_camera), f"{where}: cam_R_w2c and cam_t_w2c"
    )


def check_pose(found: Array, wanted: Array, what: str) -> None:
    """Raise where two poses differ, saying what kind of mistake it looks like."""
    if is_same_pose(found, wanted):
        return
    distance = pose.distance(found, wanted)
    difference = f"{1000 * distance.translation:.4g} mm and {np.degrees(distance.rotation):.4g} degrees"
    hint = "they hold the inverse" if is_same_pose(pose.inverse(found), wanted) else "they hold another pose"
    if is_same_pose(pose.from_rotation_translation(found[:3, :3], 1000 * found[:3, 3]), wanted):
        hint = "the translation is in metres"
    raise GateError(f"{what} are {difference} off the database's pose: {hint}")


def is_same_pose(a: Array, b: Array) -> bool:
    """Whether two poses differ by rounding only."""
    return max(pose.distance(a, b)) < POSE_TOLERANCE


def load_json(path: Path) -> Any:
    """A JSON file's content.

    Raises:
        GateError: where it is missing or broken.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, json.JSONDecodeError) as error:
        raise GateError(f"{path.parent.name}/{path.name} cannot be read: {error}") from error
