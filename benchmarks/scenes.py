"""Scenes to measure on: the demo scenes' true poses, and frames in which every pixel has a depth."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select
from sqlalchemy.orm import joinedload

from app.datasets.scene_data import SceneData
from app.storage.files import FileStore
from app.storage.tables import Frame, Scene, Task
from benchmarks.server import database_of, settings_of
from registration_core import ObjectModel
from registration_core.bop import writer as bop_writer
from registration_core.geometry import pose
from registration_core.rendering.rasterizer import render_depth
from registration_core.synthetic.objects import ProceduralObject, demo_objects
from registration_core.synthetic.scene import CAMERA

Array = NDArray[np.float64]

DEPTH_SCALE = 0.1
"""Raw depth times this is millimetres."""
START_TRANSLATION, START_ROTATION = 0.02, np.radians(15)
"""How far from the truth an operator leaves an object before a snap: metres and radians."""
DENSE_FACES = 15_000
"""As many as the meshes of scanned objects have."""
WALL_DISTANCE, WALL_WAVES, NOISE = 0.9, 0.05, 0.001
"""Of the wall that fills a full frame, metres."""


@dataclass(frozen=True)
class KnownTask:
    """A task whose true pose is known."""

    id: int
    object_id: int
    dataset: str
    obj_id: int
    model: ObjectModel
    frame: Frame
    depth: NDArray[np.float32]
    """(H, W), metres."""
    T_world_object: Array
    """(4, 4), the truth."""

    def near_pose(self, rng: np.random.Generator) -> Array:
        """A pose (4, 4) as far from the truth as an operator leaves it."""
        return pose.perturbed(self.T_world_object, START_TRANSLATION, START_ROTATION, rng)


def known_tasks(state_dir: Path) -> list[KnownTask]:
    """The tasks of a state directory, in the order of their numbers."""
    data = SceneData(FileStore(settings_of(state_dir).files_dir))
    with database_of(state_dir) as database, database.read() as session:
        parts = (
            joinedload(Task.object),
            joinedload(Task.scene).joinedload(Scene.dataset),
            joinedload(Task.frame),
        )
        rows = session.scalars(select(Task).options(*parts).order_by(Task.id)).all()
        return [
            KnownTask(
                id=row.id,
                object_id=row.object_id,
                dataset=row.scene.dataset.name,
                obj_id=row.object.obj_id,
                model=data.model(row.object),
                frame=row.frame,
                depth=data.depth(row.frame),
                T_world_object=np.array(row.T_world_object_reference),
            )
            for row in rows
            if row.T_world_object_reference is not None
        ]


def dense_objects(count: int) -> tuple[ProceduralObject, ...]:
    """The demo objects over and over, each of another size, with meshes as dense as those of scans."""
    demo, made = demo_objects(), []
    for number in range(count):
        known = demo[number % len(demo)]
        mesh = known.mesh.copy()
        while len(mesh.faces) < DENSE_FACES:
            mesh = mesh.subdivide()
        mesh.apply_scale(1.0 + 0.02 * number)
        made.append(ProceduralObject(f"{known.name} {number}", mesh, known.model.symmetries))
    return tuple(made)


def write_full_frames(folder: Path, frames: int, objects: Sequence[ProceduralObject] | None = None) -> None:
    """Write a BOP dataset of scenes with one image of 640x480 each, all of whose pixels have a depth.

    In each stands another one of the objects, of the demo scenes where none are given, before a wavy wall.
    """
    objects = objects or demo_objects()
    rng = np.random.default_rng(0)
    infos = {}
    for obj_id, known in enumerate(objects, start=1):
        bop_writer.write_mesh(folder / "models" / f"obj_{obj_id:06d}.ply", known.mesh)
        infos[obj_id] = bop_writer.model_info(known.model)
    bop_writer.write_json(folder / "models" / "models_info.json", infos)
    bop_writer.write_json(folder / "camera.json", bop_writer.camera_file(CAMERA, DEPTH_SCALE))
    for number in range(1, frames + 1):
        obj_id = 1 + (number - 1) % len(objects)
        _write_scene(folder / "test" / f"{number:06d}", obj_id, objects[obj_id - 1].model, rng)


def _write_scene(folder: Path, obj_id: int, model: ObjectModel, rng: np.random.Generator) -> None:
    turn = pose.perturbed(np.eye(4), 0.0, rng.uniform(0.0, np.pi), rng)[:3, :3]
    T_camera_object = pose.from_rotation_translation(turn, np.array([0.0, 0.0, 0.7]) - turn @ model.centre)
    depth = _wall(rng)
    rendered = render_depth(model, CAMERA, T_camera_object)
    depth[rendered > 0] = rendered[rendered > 0]
    depth += rng.normal(0.0, NOISE, depth.shape)
    shade = np.clip(
        255.0 * depth[..., None] * [0.8, 0.7, 0.6] + rng.normal(0.0, 2.0, (*depth.shape, 3)), 0, 255
    )
    bop_writer.write_depth_png(folder / "depth" / "000000.png", depth, DEPTH_SCALE)
    bop_writer.write_color_png(folder / "rgb" / "000000.png", shade.astype(np.uint8))
    bop_writer.write_json(folder / "scene_camera.json", {0: bop_writer.camera_entry(CAMERA, DEPTH_SCALE)})
    bop_writer.write_json(folder / "scene_gt.json", {0: [bop_writer.gt_entry(obj_id, T_camera_object)]})


def _wall(rng: np.random.Generator) -> Array:
    v, u = np.mgrid[: CAMERA.height, : CAMERA.width]
    across, down = rng.uniform(0.01, 0.03, 2)
    return WALL_DISTANCE + WALL_WAVES * np.sin(across * u) * np.cos(down * v)
