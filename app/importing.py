"""Takes BOP datasets in: checked whole before anything is written, and repeatable without duplicates."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select
from sqlalchemy.orm import Session

from app.database import Database
from app.scene_data import symmetries_to_json
from app.start_pose import start_pose
from app.storage import FileStore
from app.symmetries import first_version, keep_suggestions, open_suggestions, suggest
from app.tables import Dataset, Frame, Object, Scene, Task
from registration_core import ObjectModel, Symmetries
from registration_core.bop import BopDataset, BopImage, BopObject, BopScene, read_dataset, read_depth
from registration_core.viewpoint_model import check_visible

Row = TypeVar("Row", Object, Scene, Frame, Task)
Progress = Callable[[float, str], None]
DEFAULT_MODE = "accurate"
DEFAULT_CONDITION = "snap"
LONGEST_NAME = 200
"""Characters of a dataset's name."""


class DatasetImportError(ValueError):
    """The dataset cannot be taken in; nothing was changed."""


@dataclass(frozen=True)
class ImportSummary:
    """What an import added; all zero where everything was there."""

    dataset_id: int
    name: str
    objects: int
    scenes: int
    frames: int
    tasks: int


@dataclass(frozen=True)
class _World:
    """Images that share one rigid world, and the label of the scene that they become."""

    source: BopScene
    label: str
    images: tuple[BopImage, ...]
    tasks: tuple["_PlannedTask", ...]


@dataclass(frozen=True)
class _PlannedTask:
    """One instance of an object, to be registered from the first image that shows it on."""

    obj_id: int
    instance: int
    image_id: int
    T_world_object_start: NDArray[np.float64]
    T_world_object_reference: NDArray[np.float64]


def import_dataset(
    database: Database,
    files: FileStore,
    folder: Path,
    name: str | None = None,
    progress: Progress | None = None,
) -> ImportSummary:
    """Import a BOP dataset folder under its own or another name.

    What is there already is left as it is; what is new is added.

    Raises:
        ValueError: in one sentence, where the folder is not sound, or where it contradicts what was imported
            before under this name.
    """
    name = name or folder.resolve().name
    if len(name) > LONGEST_NAME:
        raise DatasetImportError(
            f"a dataset's name may have {LONGEST_NAME} characters; this one has {len(name)}; shorten it"
        )
    source = read_dataset(folder, progress)
    models = {item.obj_id: item.model for item in source.objects}
    worlds = [world for scene in source.scenes for world in _worlds(scene, models)]
    if not worlds:
        raise DatasetImportError(f"{folder} has no scenes; a scene is a folder such as test/000001")
    for item in source.objects:
        try:
            check_visible(item.model)
        except ValueError as error:
            raise DatasetImportError(f"models/{item.mesh_path.name}: {error}; replace the file") from error
    stored = _store(files, source)
    plain = {stored[o.mesh_path]: o.model for o in source.objects if o.model.symmetries == Symmetries()}
    report = partial(progress, 1.0, "looking for symmetries") if progress else lambda: None
    suggested = suggest(database, plain, report)
    with database.write() as session:
        keep_suggestions(session, suggested)
        return _Importer(session, stored, name).run(source, worlds)


def _worlds(scene: BopScene, models: dict[int, ObjectModel]) -> list[_World]:
    """The rigid worlds in a BOP scene: all posed images together, each other image by itself."""
    posed = tuple(image for image in scene.images if image.T_world_camera is not None)
    groups = [(f"scene {scene.scene_id}", posed)] if posed else []
    for image in scene.images:
        if image.T_world_camera is None:
            groups.append((f"scene {scene.scene_id} › frame {image.image_id}", (image,)))
    return [_World(scene, label, images, _planned_tasks(images, models)) for label, images in groups]


def _planned_tasks(images: tuple[BopImage, ...], models: dict[int, ObjectModel]) -> tuple[_PlannedTask, ...]:
    """A task for each annotated object instance in the images of one world."""
    planned: dict[tuple[int, int], _PlannedTask] = {}
    for image in images:
        T_world_camera = _or_identity(image.T_world_camera)
        seen: Counter[int] = Counter()
        for truth in image.ground_truth or ():
            key = truth.obj_id, seen[truth.obj_id]
            seen[truth.obj_id] += 1
            if key not in planned:
                depth = read_depth(image.depth_path, image.depth_scale)
                start = start_pose(models[truth.obj_id], depth, image.camera, T_world_camera)
                planned[key] = _PlannedTask(
                    *key, image.image_id, start, T_world_camera @ truth.T_camera_object
                )
    return tuple(planned.values())


def _store(files: FileStore, source: BopDataset) -> dict[Path, str]:
    """Put every file into the store. A file there that no row names is invisible, so this can be repeated."""
    paths = [item.mesh_path for item in source.objects]
    for scene in source.scenes:
        for image in scene.images:
            paths += [image.depth_path, *([image.color_path] if image.color_path else [])]
    return {path: files.put_file(path) for path in paths}


class _Importer:
    """Writes one dataset's rows within one transaction."""

    def __init__(self, session: Session, stored: dict[Path, str], name: str) -> None:
        self._session = session
        self._stored = stored
        self._name = name
        self._added: Counter[str] = Counter()

    def run(self, source: BopDataset, worlds: list[_World]) -> ImportSummary:
        dataset = self._session.scalar(select(Dataset).where(Dataset.name == self._name))
        if dataset is None:
            dataset = Dataset(name=self._name)
            self._session.add(dataset)
            self._session.flush()
        objects = {item.obj_id: self._object(dataset, item) for item in source.objects}
        for world in worlds:
            scene = self._scene(dataset, world)
            frames = {image.image_id: self._frame(scene, image) for image in world.images}
            for planned in world.tasks:
                self._task(scene, objects[planned.obj_id], frames[planned.image_id], planned)
        return ImportSummary(
            dataset.id,
            self._name,
            *(self._added[kind] for kind in ("objects", "scenes", "frames", "tasks")),
        )

    def _object(self, dataset: Dataset, item: BopObject) -> Object:
        row = self._session.scalar(
            select(Object).where(Object.dataset_id == dataset.id, Object.obj_id == item.obj_id)
        )
        if row is not None:
            if row.model_hash != item.model.content_hash:
                raise self._conflict(f"object {item.obj_id} with another mesh or other symmetries")
            open_suggestions(self._session, row)
            return row
        row = Object(
            dataset_id=dataset.id,
            obj_id=item.obj_id,
            name=item.name,
            mesh_hash=self._stored[item.mesh_path],
            mesh_format=item.mesh_path.suffix.lstrip(".").lower(),
            model_hash=item.model.content_hash,
            diameter=item.model.diameter,
            symmetries=symmetries_to_json(item.model.symmetries),
        )
        self._add("objects", row)
        first_version(self._session, row)
        open_suggestions(self._session, row)
        return row

    def _scene(self, dataset: Dataset, world: _World) -> Scene:
        key = {
            "dataset_id": dataset.id,
            "split": world.source.split,
            "bop_scene_id": world.source.scene_id,
            "label": world.label,
        }
        row = self._session.scalar(select(Scene).filter_by(**key))
        return row or self._add("scenes", Scene(**key))

    def _frame(self, scene: Scene, image: BopImage) -> Frame:
        camera, T_world_camera = image.camera, image.T_world_camera
        row = Frame(
            scene_id=scene.id,
            image_id=image.image_id,
            color_hash=self._stored[image.color_path] if image.color_path else None,
            depth_hash=self._stored[image.depth_path],
            depth_scale=image.depth_scale,
            width=camera.width,
            height=camera.height,
            fx=camera.fx,
            fy=camera.fy,
            cx=camera.cx,
            cy=camera.cy,
            T_world_camera=_or_identity(T_world_camera).tolist(),
            posed=T_world_camera is not None,
        )
        found = self._session.scalar(select(Frame).filter_by(scene_id=scene.id, image_id=image.image_id))
        if found is None:
            return self._add("frames", row)
        fields = ("color_hash", "depth_hash", "depth_scale", "fx", "fy", "cx", "cy", "T_world_camera")
        if any(getattr(found, field) != getattr(row, field) for field in fields):
            raise self._conflict(f"image {image.image_id} of {scene.label} with other content")
        return found

    def _task(self, scene: Scene, item: Object, frame: Frame, planned: _PlannedTask) -> None:
        key = {
            "scene_id": scene.id,
            "object_id": item.id,
            "instance": planned.instance,
            "mode": DEFAULT_MODE,
            "condition": DEFAULT_CONDITION,
        }
        if self._session.scalar(select(Task).filter_by(**key)) is None:
            task = Task(
                **key,
                frame_id=frame.id,
                T_world_object_start=planned.T_world_object_start.tolist(),
                T_world_object_reference=planned.T_world_object_reference.tolist(),
            )
            self._add("tasks", task)

    def _add(self, kind: str, row: Row) -> Row:
        self._session.add(row)
        self._session.flush()
        self._added[kind] += 1
        return row

    def _conflict(self, what: str) -> DatasetImportError:
        return DatasetImportError(
            f"dataset {self._name!r} was imported before and has {what};"
            " import this one under another name (--name)"
        )


def _or_identity(T_world_camera: NDArray[np.float64] | None) -> NDArray[np.float64]:
    return np.eye(4) if T_world_camera is None else T_world_camera
