"""Takes datasets in: checked whole before anything is written, and repeatable without duplicates."""

import math
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.datasets.formats.registry import as_bop
from app.datasets.import_plan import PlannedTask, World, or_identity, worlds_of
from app.datasets.import_warnings import DatasetWarning, dataset_warnings, median_depth, suggested_depth_scale
from app.datasets.scene_data import symmetries_to_json
from app.datasets.symmetries import first_version, keep_suggestions, open_suggestions, suggest
from app.storage.database import Database
from app.storage.files import FileStore
from app.storage.tables import Dataset, Frame, Object, Scene, Task
from app.storage.unfinished import unfinished
from registration_core import Symmetries
from registration_core.bop.dataset import BopDataset, BopImage, BopObject, read_dataset, with_depth_scale
from registration_core.bop.fields import LONGEST_NAME, is_name
from registration_core.bop.images import plain_color, plain_depth
from registration_core.search.viewpoint_model import check_visible

Row = TypeVar("Row", Object, Scene, Frame, Task)
Progress = Callable[[float, str], None]
DEFAULT_MODE = "accurate"
DEFAULT_CONDITION = "snap"


class DatasetImportError(ValueError):
    """The dataset cannot be taken in; nothing was changed."""


class ImplausibleDepthError(DatasetImportError):
    """The depth scale is not that of the depth images; `suggested` would be plausible."""

    def __init__(self, source: BopDataset, suggested: float) -> None:
        self.suggested = suggested
        image = source.scenes[0].images[0]
        super().__init__(
            f"depth would lie at {median_depth(image):.3g} m with depth_scale {image.depth_scale:g} (raw"
            " depth times it is millimetres); correct it in scene_camera.json, or import with depth scale"
            f" {suggested:g}"
        )


@dataclass(frozen=True)
class ImportSummary:
    """What an import added; all zero where everything was there."""

    dataset_id: int
    name: str
    objects: int
    scenes: int
    frames: int
    tasks: int
    warnings: tuple[DatasetWarning, ...]
    """What looks odd in what was there to be taken in."""


def import_dataset(
    database: Database,
    files: FileStore,
    folder: Path,
    name: str | None = None,
    progress: Progress | None = None,
    depth_scale: float | None = None,
) -> ImportSummary:
    """Import the dataset in a folder under its own or another name.

    What is there already is left as it is; what is new is added.

    Args:
        database: Where its rows go.
        files: Where its files go.
        folder: The dataset's, or one that it lies in.
        name: Of the dataset; None for its folder's.
        progress: Told how far it is.
        depth_scale: In the place of the dataset's own: raw depth times it is millimetres.

    Raises:
        ValueError: in one sentence, where the folder is not sound, or where it contradicts what was imported
            before under this name.
    """
    with in_bop_form(folder, files) as root:
        return import_bop(database, files, root, name or root.resolve().name, progress, depth_scale)


@contextmanager
def in_bop_form(folder: Path, files: FileStore) -> Iterator[Path]:
    """The root of the dataset in a folder, in the form of BOP until the block ends.

    Raises:
        ValueError: in one sentence, where no dataset is found.
    """
    files.root.mkdir(parents=True, exist_ok=True)
    with unfinished(files.root) as work:
        yield as_bop(folder, work)


def import_bop(
    database: Database,
    files: FileStore,
    folder: Path,
    name: str,
    progress: Progress | None = None,
    depth_scale: float | None = None,
) -> ImportSummary:
    """Import the BOP dataset that a folder is, as `import_dataset` does."""
    check_name(name)
    source = _in_plausible_units(read_dataset(folder, progress), depth_scale)
    models = {item.obj_id: item.model for item in source.objects}
    worlds = [world for scene in source.scenes for world in worlds_of(scene, models)]
    if not worlds:
        raise DatasetImportError(f"{folder} has no scenes; a scene is a folder such as test/000001")
    for item in source.objects:
        try:
            check_visible(item.model)
        except ValueError as error:
            raise DatasetImportError(f"models/{item.mesh_path.name}: {error}; replace the file") from error
    warnings = tuple(dataset_warnings(source))
    stored = _store(files, source)
    plain = {stored[o.mesh_path]: o.model for o in source.objects if o.model.symmetries == Symmetries()}
    report = partial(progress, 1.0, "looking for symmetries") if progress else lambda: None
    suggested = suggest(database, plain, report)
    with database.write() as session:
        keep_suggestions(session, suggested)
        return _Importer(session, stored, name, warnings).run(source, worlds)


def check_name(name: str) -> None:
    """Raise where a dataset cannot have this name."""
    if len(name) > LONGEST_NAME:
        raise DatasetImportError(
            f"a dataset's name may have {LONGEST_NAME} characters; this one has {len(name)}; shorten it"
        )
    if not is_name(name):
        raise DatasetImportError(
            f"a dataset's name must be readable; {name!r} is not: choose another (--name)"
        )


def _in_plausible_units(source: BopDataset, depth_scale: float | None) -> BopDataset:
    """The dataset with this depth scale in the place of its own, where one is given.

    Raises:
        ImplausibleDepthError: where its depth then lies nowhere near where a depth camera sees.
    """
    if depth_scale is not None:
        if not 0.0 < depth_scale < math.inf:
            raise DatasetImportError(
                f"the depth scale must be a number above 0: raw depth times it is mm; it is {depth_scale:g}"
            )
        source = with_depth_scale(source, depth_scale)
    suggested = suggested_depth_scale(source)
    if suggested is not None:
        raise ImplausibleDepthError(source, suggested)
    return source


def _store(files: FileStore, source: BopDataset) -> dict[Path, str]:
    """Put every file into the store. A file there that no row names is invisible, so this can be repeated."""
    stored = {}
    for item in source.objects:
        stored[item.mesh_path] = files.put_file(item.mesh_path)
        if item.texture:
            stored[item.texture.path] = files.put_bytes(plain_color(item.texture))
    for scene in source.scenes:
        for image in scene.images:
            stored[image.depth.path] = files.put_bytes(plain_depth(image.depth))
            if image.color:
                stored[image.color.path] = files.put_bytes(plain_color(image.color))
    return stored


class _Importer:
    """Writes one dataset's rows within one transaction."""

    def __init__(
        self, session: Session, stored: dict[Path, str], name: str, warnings: tuple[DatasetWarning, ...]
    ) -> None:
        self._session = session
        self._stored = stored
        self._name = name
        self._warnings = warnings
        self._added: Counter[str] = Counter()

    def run(self, source: BopDataset, worlds: list[World]) -> ImportSummary:
        dataset = self._session.scalar(select(Dataset).where(Dataset.name == self._name))
        if dataset is None:
            dataset = Dataset(name=self._name, warnings=[])
            self._session.add(dataset)
            self._session.flush()
        dataset.warnings = merged_warnings(dataset.warnings, self._warnings)
        objects = {item.obj_id: self._object(dataset, item) for item in source.objects}
        for world in worlds:
            scene = self._scene(dataset, world)
            frames = {image.image_id: self._frame(scene, image) for image in world.images}
            for planned in world.tasks:
                self._task(scene, objects[planned.obj_id], frames[planned.image_id], planned)
        return ImportSummary(
            dataset.id,
            self._name,
            objects=self._added["objects"],
            scenes=self._added["scenes"],
            frames=self._added["frames"],
            tasks=self._added["tasks"],
            warnings=self._warnings,
        )

    def _object(self, dataset: Dataset, item: BopObject) -> Object:
        row = self._session.scalar(
            select(Object).where(Object.dataset_id == dataset.id, Object.obj_id == item.obj_id)
        )
        if row is not None:
            if row.model_hash != item.model.content_hash:
                raise self._conflict(f"object {item.obj_id} with another mesh or other symmetries")
            row.texture_hash = row.texture_hash or self._texture_of(item)
            open_suggestions(self._session, row)
            return row
        row = Object(
            dataset_id=dataset.id,
            obj_id=item.obj_id,
            name=item.name,
            mesh_hash=self._stored[item.mesh_path],
            mesh_format=item.mesh_path.suffix.lstrip(".").lower(),
            texture_hash=self._texture_of(item),
            model_hash=item.model.content_hash,
            diameter=item.model.diameter,
            symmetries=symmetries_to_json(item.model.symmetries),
        )
        self._add("objects", row)
        first_version(self._session, row)
        open_suggestions(self._session, row)
        return row

    def _texture_of(self, item: BopObject) -> str | None:
        return self._stored[item.texture.path] if item.texture else None

    def _scene(self, dataset: Dataset, world: World) -> Scene:
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
            color_hash=self._stored[image.color.path] if image.color else None,
            depth_hash=self._stored[image.depth.path],
            depth_scale=image.depth_scale,
            width=camera.width,
            height=camera.height,
            fx=camera.fx,
            fy=camera.fy,
            cx=camera.cx,
            cy=camera.cy,
            T_world_camera=or_identity(T_world_camera).tolist(),
            posed=T_world_camera is not None,
        )
        found = self._session.scalar(select(Frame).filter_by(scene_id=scene.id, image_id=image.image_id))
        if found is None:
            return self._add("frames", row)
        fields = ("color_hash", "depth_hash", "depth_scale", "fx", "fy", "cx", "cy", "T_world_camera")
        if any(getattr(found, field) != getattr(row, field) for field in fields):
            raise self._conflict(f"image {image.image_id} of {scene.label} with other content")
        return found

    def _task(self, scene: Scene, item: Object, frame: Frame, planned: PlannedTask) -> None:
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


def merged_warnings(known: list[dict[str, Any]], found: tuple[DatasetWarning, ...]) -> list[dict[str, Any]]:
    """A dataset's warnings after another import: those of before keep whether they were accepted."""
    accepted = {warning["text"]: warning["accepted"] for warning in known}
    new = [
        {"text": item.text, "images": list(item.images), "accepted": accepted.get(item.text, False)}
        for item in found
    ]
    texts = {warning["text"] for warning in new}
    return [warning for warning in known if warning["text"] not in texts] + new
