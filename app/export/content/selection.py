"""What an export holds: the images of every scene with a submitted registration, and the poses kept."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import groupby

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import func, select
from sqlalchemy.orm import Session, contains_eager, joinedload

from app.datasets.scene_data import camera_of, symmetries_from_json
from app.storage.tables import (
    ENDED_BY,
    NAMED,
    OUTSIDE_STUDIES,
    Dataset,
    Frame,
    Object,
    Registration,
    Scene,
    Task,
)
from registration_core import Intrinsics, Symmetries

Array = NDArray[np.float64]

SUBMITTED, SKIPPED = "submitted", "skipped"
ACCURATE = "accurate"


class ExportError(Exception):
    """The dataset cannot be exported; the message is one sentence."""


@dataclass(frozen=True)
class ExportObject:
    """A known object and its stored mesh file."""

    obj_id: int
    name: str
    mesh_hash: str
    mesh_format: str
    symmetries: Symmetries
    texture_hash: str | None = None
    """Of the mesh's picture, where it has one."""


@dataclass(frozen=True)
class Choice:
    """Which part of a dataset is exported."""

    scene_ids: frozenset[int] | None = None
    """Rows of `Scene`; None for all."""
    without: frozenset[int] = frozenset()
    """Registrations that are left out."""


EVERYTHING = Choice()


@dataclass(frozen=True, eq=False)
class Annotation:
    """The pose kept of one instance of an object."""

    registration_id: int
    obj_id: int
    instance: int
    name: str
    """Of its task."""
    T_world_object: Array
    """(4, 4), metres."""
    candidates: int
    """How many submitted registrations it was taken from."""
    submitted_at: datetime


@dataclass(frozen=True, eq=False)
class ExportImage:
    """One RGB-D image with the annotations of its world."""

    image_id: int
    color_hash: str | None
    depth_hash: str
    depth_scale: float
    """Raw depth times this is millimetres."""
    camera: Intrinsics
    T_world_camera: Array
    """(4, 4), metres; the identity where the camera's pose is not known."""
    posed: bool
    """Whether the camera's pose is known."""
    annotations: tuple[Annotation, ...]


@dataclass(frozen=True)
class ExportScene:
    """The images that go into one scene folder."""

    split: str
    scene_id: int
    images: tuple[ExportImage, ...]

    @property
    def folder(self) -> str:
        """Where it lies in the dataset, such as "test/000001"."""
        return f"{self.split}/{self.scene_id:06d}"


@dataclass(frozen=True)
class Selection:
    """Everything that one export holds, as the database had it at one moment."""

    dataset_id: int
    name: str
    objects: tuple[ExportObject, ...]
    scenes: tuple[ExportScene, ...]
    images_left_out: int
    """Images of scenes without a submitted registration."""
    instances_open: int
    """Object instances of the exported scenes that nobody submitted yet."""
    instances_skipped: tuple[tuple[str, int], ...]
    """How many of those somebody skipped, by reason; one for which people differ counts for each reason."""

    @property
    def annotations(self) -> list[Annotation]:
        """Every annotation once, in the order of scenes."""
        images = [image for scene in self.scenes for image in scene.images]
        unique = {id(annotation): annotation for image in images for annotation in image.annotations}
        return list(unique.values())

    @property
    def newest_submission(self) -> datetime:
        """When the last of the annotations was submitted."""
        return max(annotation.submitted_at for annotation in self.annotations)


def select_dataset(session: Session, dataset_id: int, choice: Choice = EVERYTHING) -> Selection:
    """Choose what an export of a dataset, or of a part of it, holds.

    Raises:
        ExportError: where there is no such dataset, nothing is submitted in it, or two of its images would
            get the same file name.
    """
    dataset = session.get(Dataset, dataset_id)
    if dataset is None:
        raise ExportError(f"dataset {dataset_id} does not exist")
    annotations = select_annotations(session, dataset_id, choice)
    if not annotations:
        raise ExportError(
            f"dataset {dataset.name!r} has no submitted registration{part_of(choice)}; submit at least one,"
            " then export again"
        )
    objects = session.scalars(
        select(Object).where(Object.dataset_id == dataset_id).order_by(Object.obj_id)
    ).all()
    instances = session.execute(
        select(Task.scene_id, Task.object_id, Task.instance).where(Task.scene_id.in_(annotations)).distinct()
    ).all()
    images_in_all = session.scalar(
        select(func.count()).select_from(Frame).join(Scene).where(Scene.dataset_id == dataset_id)
    )
    scenes = select_scenes(session, annotations)
    return Selection(
        dataset_id,
        dataset.name,
        tuple(export_object(row) for row in objects),
        scenes,
        images_left_out=(images_in_all or 0) - sum(len(scene.images) for scene in scenes),
        instances_open=len(instances) - sum(map(len, annotations.values())),
        instances_skipped=count_skipped(session, annotations),
    )


def count_skipped(
    session: Session, annotations: dict[int, tuple[Annotation, ...]]
) -> tuple[tuple[str, int], ...]:
    """Reasons why instances of the annotated scenes have no annotation, and of how many."""
    rows = session.scalars(
        select(Registration)
        .join(Registration.task)
        .where(Task.scene_id.in_(annotations), Registration.state == SKIPPED, OUTSIDE_STUDIES)
        .options(contains_eager(Registration.task).joinedload(Task.object))
    ).all()
    annotated = {(scene, a.obj_id, a.instance) for scene, found in annotations.items() for a in found}
    skipped = {(instance_key(row), str(row.skip_reason)) for row in rows}
    counts = Counter(reason for key, reason in skipped if key not in annotated)
    return tuple(sorted(counts.items()))


def part_of(choice: Choice) -> str:
    """Words for messages that say of which part of a dataset they speak."""
    return "" if choice == EVERYTHING else " in the chosen part"


def select_annotations(
    session: Session, dataset_id: int, choice: Choice
) -> dict[int, tuple[Annotation, ...]]:
    """By scene: one annotation for each instance that somebody submitted, in order of obj_id and instance."""
    wanted = [] if choice.scene_ids is None else [Scene.id.in_(choice.scene_ids)]
    registrations = session.scalars(
        select(Registration)
        .join(Registration.task)
        .join(Task.scene)
        .join(Task.object)
        .where(
            Scene.dataset_id == dataset_id,
            Registration.state == SUBMITTED,
            Registration.id.not_in(choice.without),
            OUTSIDE_STUDIES,
            *wanted,
        )
        .options(ENDED_BY, contains_eager(Registration.task).options(*NAMED))
        .order_by(Task.scene_id, Object.obj_id, Task.instance, Registration.id)
    ).all()
    annotations: dict[int, list[Annotation]] = {}
    for (scene_id, _, _), group in groupby(registrations, key=instance_key):
        annotations.setdefault(scene_id, []).append(annotation_of(list(group)))
    return {scene_id: tuple(found) for scene_id, found in annotations.items()}


def instance_key(registration: Registration) -> tuple[int, int, int]:
    """What registrations of one and the same thing share, whatever their tasks' mode and condition."""
    task = registration.task
    return task.scene_id, task.object.obj_id, task.instance


def annotation_of(registrations: Sequence[Registration]) -> Annotation:
    """The newest submitted registration of an instance; one made accurately goes before a quick one."""
    kept = max(
        registrations,
        key=lambda row: (row.task.mode == ACCURATE, row.ended_by or 0, row.submitted_at, row.id),
    )
    assert kept.T_world_object is not None and kept.submitted_at is not None
    return Annotation(
        kept.id,
        kept.task.object.obj_id,
        kept.task.instance,
        kept.task.name,
        np.array(kept.T_world_object, dtype=np.float64),
        len(registrations),
        kept.submitted_at,
    )


def select_scenes(
    session: Session, annotations: dict[int, tuple[Annotation, ...]]
) -> tuple[ExportScene, ...]:
    """The scenes in folder order; images imported one world each meet again in their scene."""
    rows = session.scalars(
        select(Scene)
        .where(Scene.id.in_(annotations))
        .options(joinedload(Scene.frames))
        .order_by(Scene.split, Scene.bop_scene_id, Scene.id)
    ).unique()
    scenes = []
    for (split, scene_id), worlds in groupby(rows, key=lambda row: (row.split, row.bop_scene_id)):
        images = [export_image(frame, annotations[world.id]) for world in worlds for frame in world.frames]
        images.sort(key=lambda image: image.image_id)
        scene = ExportScene(split, scene_id, tuple(images))
        check_image_ids(scene)
        scenes.append(scene)
    return tuple(scenes)


def check_image_ids(scene: ExportScene) -> None:
    """Raise where two images of a scene folder have the same id."""
    duplicate = first_duplicate(image.image_id for image in scene.images)
    if duplicate is not None:
        raise ExportError(
            f"{scene.folder} has image {duplicate} twice, in two worlds; import one of them as another scene"
        )


def first_duplicate(values: Iterable[int]) -> int | None:
    """The first value that was there before."""
    seen: set[int] = set()
    for value in values:
        if value in seen:
            return value
        seen.add(value)
    return None


def export_object(row: Object) -> ExportObject:
    """An object of the database."""
    return ExportObject(
        row.obj_id,
        row.name,
        row.mesh_hash,
        row.mesh_format,
        symmetries_from_json(row.symmetries),
        row.texture_hash,
    )


def export_image(frame: Frame, annotations: tuple[Annotation, ...]) -> ExportImage:
    """A frame of the database with the annotations of its scene."""
    return ExportImage(
        frame.image_id,
        frame.color_hash,
        frame.depth_hash,
        frame.depth_scale,
        camera_of(frame),
        np.array(frame.T_world_camera, dtype=np.float64),
        frame.posed,
        annotations,
    )
