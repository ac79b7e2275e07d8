"""A small labelled dataset in a real database and file store: boxes on a table, seen by a depth camera."""

from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from shutil import copytree

import numpy as np
import trimesh
from PIL import Image
from sqlalchemy.orm import Session

from app.datasets.symmetries import first_version
from app.export.content.selection import select_dataset
from app.export.gate.checks import Expected, expected_images
from app.export.job import export_dataset
from app.storage.database import Database
from app.storage.files import FileStore
from app.storage.tables import Dataset, Frame, Object, Registration, Scene, Task, User
from registration_core import Intrinsics, ObjectModel, Symmetries
from registration_core.bop.writer import write_color_png, write_depth_png, write_mesh
from registration_core.geometry import pose
from registration_core.geometry.object_model import discrete
from registration_core.rendering.rasterizer import render_depth
from tests.app.empty_database import NAME, new_empty_database

CAMERA = Intrinsics(320, 240, 300.0, 300.0, 159.5, 119.5)
DEPTH_SCALE = 0.1
TOOL, BLOCK = 3, 7
START = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)

HALF_TURN = pose.exp([0.0, 0.0, 0.0, 0.0, 0.0, np.pi])

T_WORLD_TOOL = pose.exp([0.03, 0.01, 0.02, 0.0, 0.0, 0.5])
T_WORLD_BLOCK = pose.exp([-0.05, 0.0, 0.03, 0.0, 0.0, -0.3])


def looking_at(eye: tuple[float, float, float], target: tuple[float, float, float]) -> np.ndarray:
    """T_world_camera (4, 4) of a camera at `eye` that looks at `target`, with z of the world up."""
    z = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return pose.from_rotation_translation(np.stack([x, np.cross(z, x), z], axis=1), eye)


NEAR_VIEW = looking_at((0.0, -0.4, 0.3), (0.0, 0.0, 0.0))
SIDE_VIEW = looking_at((0.35, -0.2, 0.3), (0.0, 0.0, 0.02))
OBJECTS_OUTSIDE = looking_at((0.0, -0.4, 0.3), (-0.6, 0.2, 0.0))
BLOCK_CUT_OFF = looking_at((0.0, -0.4, 0.3), (0.21, 0.0, 0.0))
OBJECTS_BEHIND = looking_at((0.0, -0.4, 0.3), (0.0, -2.0, 0.0))


def box(size: tuple[float, float, float], centre: tuple[float, float, float]) -> trimesh.Trimesh:
    """A box, metres."""
    return trimesh.creation.box(size, pose.exp([*centre, 0.0, 0.0, 0.0]))


def mesh_of(obj_id: int) -> trimesh.Trimesh:
    """The tool is two boxes in the shape of an L; the block is one."""
    if obj_id == BLOCK:
        return box((0.04, 0.06, 0.06), (0.0, 0.0, 0.0))
    return trimesh.util.concatenate(
        [box((0.08, 0.03, 0.04), (0.0, 0.0, 0.0)), box((0.03, 0.05, 0.04), (0.025, 0.04, 0.0))]
    )


def model_of(mesh: trimesh.Trimesh) -> ObjectModel:
    """A model of a mesh in metres."""
    return ObjectModel(np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int32))


BACKGROUND = [
    box((1.2, 1.2, 0.02), (0.0, 0.0, -0.01)),  # the table
    box((0.02, 0.02, 0.2), (0.03, -0.08, 0.1)),  # an occluder that is nobody's model
]


def observed_depth(T_world_camera: np.ndarray) -> np.ndarray:
    """What a camera in the scene measures (H, W), metres, with a hole where it measures nothing."""
    T_camera_world = pose.inverse(T_world_camera)
    placed = [(mesh, np.eye(4)) for mesh in BACKGROUND]
    placed += [(mesh_of(TOOL), T_WORLD_TOOL), (mesh_of(BLOCK), T_WORLD_BLOCK)]
    layers = [render_depth(model_of(mesh), CAMERA, T_camera_world @ T) for mesh, T in placed]
    depth = np.where(np.stack(layers) > 0, layers, np.inf).min(axis=0)
    depth[~np.isfinite(depth)] = 0.0
    depth[116:124, 180:190] = 0.0
    return depth.astype(np.float32)


@dataclass
class Site:
    """A database, a file store, and the dataset in them."""

    database: Database
    files: FileStore
    folder: Path
    dataset_id: int = 0
    users: list[int] = field(default_factory=list)
    tasks: dict[tuple[str, int], int] = field(default_factory=dict)
    """Task id by scene label and obj_id."""

    def copied(self, folder: Path) -> "Site":
        """The same in another folder, to be changed; this one has to be at rest."""
        copytree(self.folder, folder, dirs_exist_ok=True)
        database = Database(f"sqlite:///{folder / NAME}")
        return replace(self, database=database, files=FileStore(folder / "files"), folder=folder)

    def submit(self, task_id: int, T_world_object: np.ndarray, user: int = 0, minutes: float = 0.0) -> int:
        """A submitted registration; its id."""
        with self.database.write() as session:
            row = Registration(
                task_id=task_id,
                user_id=self.users[user],
                state="submitted",
                T_world_object=T_world_object.tolist(),
                created_at=START,
                submitted_at=START + timedelta(minutes=minutes),
            )
            session.add(row)
            session.flush()
            return row.id

    def submit_all(self) -> None:
        """The true pose of every task."""
        for (label, obj_id), task_id in self.tasks.items():
            self.submit(task_id, true_pose(label, obj_id))

    def add_task(self, label: str, obj_id: int, **values: object) -> int:
        """Another task for the thing that a task is for."""
        with self.database.write() as session:
            first = session.get_one(Task, self.tasks[label, obj_id])
            keys = (
                "scene_id",
                "object_id",
                "instance",
                "mode",
                "condition",
                "frame_id",
                "T_world_object_start",
            )
            task = Task(**({key: getattr(first, key) for key in keys} | values))
            session.add(task)
            session.flush()
            return task.id


POSED = "scene 1"
UNPOSED = {0: "scene 2, frame 0", 4: "scene 2, frame 4"}
UNPOSED_VIEWS = {0: NEAR_VIEW, 4: SIDE_VIEW}
POSED_VIEWS = {0: NEAR_VIEW, 5: SIDE_VIEW, 6: OBJECTS_OUTSIDE, 7: OBJECTS_BEHIND, 8: BLOCK_CUT_OFF}


def true_pose(label: str, obj_id: int) -> np.ndarray:
    """T_world_object (4, 4); the world of an image without a camera pose is its camera."""
    T = T_WORLD_TOOL if obj_id == TOOL else T_WORLD_BLOCK
    for image_id, name in UNPOSED.items():
        if label == name:
            return pose.inverse(UNPOSED_VIEWS[image_id]) @ T
    return T


def make_site(folder: Path) -> Site:
    """The dataset in a new database: nothing is submitted yet."""
    database = new_empty_database(folder)
    site = Site(database, FileStore(folder / "files"), folder)
    with database.write() as session:
        users = [User(name=name, role="operator") for name in ("Ada Lovelace", "Grace Hopper")]
        dataset = Dataset(name="Two boxes / v1")
        session.add_all([*users, dataset])
        session.flush()
        site.users = [user.id for user in users]
        site.dataset_id = dataset.id
        objects = {obj_id: add_object(session, site, obj_id) for obj_id in (TOOL, BLOCK)}
        add_scene(session, site, objects, 1, POSED, POSED_VIEWS, posed=True)
        for image_id, label in UNPOSED.items():
            views = {image_id: UNPOSED_VIEWS[image_id]}
            add_scene(session, site, objects, 2, label, views, posed=False)
    return site


def add_object(session: Session, site: Site, obj_id: int) -> Object:
    """An object and its mesh file."""
    path = site.folder / f"{obj_id}.ply"
    write_mesh(path, mesh_of(obj_id))
    symmetries = discrete([HALF_TURN]) if obj_id == BLOCK else Symmetries()
    model = ObjectModel.load(path, unit="mm", symmetries=symmetries)
    row = Object(
        dataset_id=site.dataset_id,
        obj_id=obj_id,
        name={TOOL: "angle tool", BLOCK: "block"}[obj_id],
        mesh_hash=site.files.put_file(path),
        mesh_format="ply",
        model_hash=model.content_hash,
        diameter=model.diameter,
        symmetries={"discrete": [HALF_TURN.tolist()] if obj_id == BLOCK else [], "continuous": []},
    )
    session.add(row)
    session.flush()
    first_version(session, row)
    return row


def add_scene(
    session: Session,
    site: Site,
    objects: dict[int, Object],
    bop_scene_id: int,
    label: str,
    views: dict[int, np.ndarray],
    *,
    posed: bool,
) -> None:
    """A scene with its frames, and a task for each object."""
    scene = Scene(dataset_id=site.dataset_id, split="test", bop_scene_id=bop_scene_id, label=label)
    session.add(scene)
    session.flush()
    frames = [add_frame(session, site, scene, image_id, T, posed) for image_id, T in views.items()]
    for obj_id, row in objects.items():
        task = Task(
            scene_id=scene.id,
            object_id=row.id,
            instance=0,
            mode="accurate",
            condition="snap",
            frame_id=frames[0].id,
            T_world_object_start=np.eye(4).tolist(),
        )
        session.add(task)
        session.flush()
        site.tasks[label, obj_id] = task.id


def add_frame(
    session: Session, site: Site, scene: Scene, image_id: int, T_world_camera: np.ndarray, posed: bool
) -> Frame:
    """A frame: image 0 in colour, image 5 grey, image 4 a JPEG, the others without a picture."""
    depth = observed_depth(T_world_camera)
    depth_path, color_path = site.folder / "depth.png", site.folder / "color.png"
    write_depth_png(depth_path, depth, DEPTH_SCALE)
    grey = (255 * depth / max(depth.max(), 1.0)).astype(np.uint8)
    color_hash = None
    if image_id == 0:
        write_color_png(color_path, np.stack([grey, grey, 255 - grey], axis=-1))
        color_hash = site.files.put_file(color_path)
    elif image_id in {4, 5}:
        Image.fromarray(grey).save(color_path, format="JPEG" if image_id == 4 else "PNG")
        color_hash = site.files.put_file(color_path)
    frame = Frame(
        scene_id=scene.id,
        image_id=image_id,
        color_hash=color_hash,
        depth_hash=site.files.put_file(depth_path),
        depth_scale=DEPTH_SCALE,
        width=CAMERA.width,
        height=CAMERA.height,
        fx=CAMERA.fx,
        fy=CAMERA.fy,
        cx=CAMERA.cx,
        cy=CAMERA.cy,
        T_world_camera=(T_world_camera if posed else np.eye(4)).tolist(),
        posed=posed,
    )
    session.add(frame)
    session.flush()
    return frame


def ignore_progress(share: float, message: str) -> None:
    """Progress that nobody looks at."""


class ExportedSite:
    """A dataset with every true pose submitted, and its export as a folder."""

    def __init__(self, folder: Path) -> None:
        self.site = make_site(folder)
        self.site.submit_all()
        self.root = folder / "export"
        export_dataset(self.site.database, self.site.files, self.site.dataset_id, self.root, ignore_progress)
        with self.site.database.read() as session:
            self.expected: Expected = expected_images(select_dataset(session, self.site.dataset_id))
