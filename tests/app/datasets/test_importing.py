"""Taking datasets in: whole, once, and with one clear sentence where something is wrong."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from sqlalchemy import select

from app.datasets.importing import import_dataset
from app.datasets.scene_data import SceneData, symmetries_from_json
from app.storage.tables import Dataset, Frame, Object, Scene, Task
from registration_core.bop.writer import camera_entry, gt_entry
from registration_core.geometry import pose
from tests.app.imports import added, everything
from tests.app.small_dataset import (
    BLOCK,
    CAMERA,
    NAME,
    NEAR_VIEW,
    POSED_SCENE,
    SIDE_VIEW,
    TOOL,
    UNPOSED_SCENE,
    change_json,
    true_pose,
)

# -- what is taken in


def test_each_image_without_a_camera_pose_is_a_scene_of_its_own(database, files, demo):
    summary = import_dataset(database, files, demo)
    assert (summary.name, *added(summary)) == (NAME, 2, 2, 3, 4)
    with database.read() as session:
        scenes = session.scalars(select(Scene).order_by(Scene.id)).all()
        assert [(scene.label, [frame.image_id for frame in scene.frames]) for scene in scenes] == [
            ("scene 1", [0, 5]),
            ("scene 2 › frame 0", [0]),
        ]
        assert [(scene.split, scene.bop_scene_id) for scene in scenes] == [("test", 1), ("test", 2)]
        first, second, alone = session.scalars(select(Frame).order_by(Frame.id))
        objects = {row.obj_id: row for row in session.scalars(select(Object))}
    assert np.allclose(first.T_world_camera, NEAR_VIEW) and np.allclose(second.T_world_camera, SIDE_VIEW)
    assert first.posed and not alone.posed
    assert np.array_equal(alone.T_world_camera, np.eye(4))
    assert (first.width, first.height, first.fx, first.cy) == (320, 240, CAMERA.fx, CAMERA.cy)
    assert first.depth_scale == pytest.approx(0.1)
    assert {row.name for row in objects.values()} == {"angle tool", "block"}
    assert objects[BLOCK].diameter == pytest.approx(np.linalg.norm([0.04, 0.06, 0.06]))


def test_each_annotated_instance_is_a_task_with_its_reference(database, files, demo):
    import_dataset(database, files, demo)
    with database.read() as session:
        tasks = session.scalars(select(Task).order_by(Task.id)).all()
        found = [(task.scene.bop_scene_id, task.object.obj_id, task.frame.image_id) for task in tasks]
    assert found == [(1, TOOL, 0), (1, BLOCK, 0), (2, TOOL, 0), (2, BLOCK, 0)]
    for task, (scene, obj_id, _) in zip(tasks, found, strict=True):
        reference = true_pose(obj_id, posed=scene == 1)
        assert np.allclose(task.T_world_object_reference, reference, atol=1e-9)
        assert np.linalg.norm(np.array(task.T_world_object_start) - reference) > 0.01  # nothing is given away
        assert (task.mode, task.condition, task.instance) == ("accurate", "snap", 0)


def test_two_of_one_object_are_two_tasks(database, files, demo_copy):
    again = gt_entry(BLOCK, pose.exp([0.1, 0.0, 0.5, 0.0, 0.0, 0.0]))
    change_json(demo_copy / UNPOSED_SCENE / "scene_gt.json", lambda truths: truths["0"].append(again))
    import_dataset(database, files, demo_copy)
    with database.read() as session:
        query = select(Task).join(Task.scene).join(Task.object)
        twins = session.scalars(query.where(Scene.bop_scene_id == 2, Object.obj_id == BLOCK)).all()
    assert sorted(task.instance for task in twins) == [0, 1]
    assert np.allclose(twins[1].T_world_object_reference, pose.exp([0.1, 0, 0.5, 0, 0, 0]))


def test_an_object_that_shows_later_is_a_task_from_there(database, files, demo_copy):
    change_json(demo_copy / POSED_SCENE / "scene_gt.json", lambda truths: truths["0"].pop(0))
    import_dataset(database, files, demo_copy)
    with database.read() as session:
        task = session.scalars(
            select(Task)
            .join(Task.scene)
            .join(Task.object)
            .where(Scene.bop_scene_id == 1, Object.obj_id == TOOL)
        ).one()
        assert task.frame.image_id == 5
        assert np.allclose(task.T_world_object_reference, true_pose(TOOL))


def test_without_annotations_there_are_scenes_but_no_tasks(database, files, demo_copy):
    (demo_copy / POSED_SCENE / "scene_gt.json").unlink()
    shutil.rmtree(demo_copy / UNPOSED_SCENE)
    assert added(import_dataset(database, files, demo_copy)) == (2, 1, 2, 0)


def test_symmetries_survive_the_way_into_the_database(database, files, demo_copy):
    half_turn = np.diag([-1.0, -1.0, 1.0, 1.0]).ravel().tolist()
    change_json(
        demo_copy / "models/models_info.json",
        lambda infos: infos[str(BLOCK)].update(
            symmetries_discrete=[half_turn], symmetries_continuous=[{"axis": [0, 0, 1], "offset": [1, 2, 3]}]
        ),
    )
    import_dataset(database, files, demo_copy)
    with database.read() as session:
        row = session.scalars(select(Object).where(Object.obj_id == BLOCK)).one()
    model = SceneData(files).model(row)
    assert model.content_hash == row.model_hash
    symmetries = symmetries_from_json(row.symmetries)
    assert np.allclose(symmetries.discrete[0], np.diag([-1.0, -1.0, 1.0, 1.0]))
    assert symmetries.continuous[0].offset == pytest.approx((0.001, 0.002, 0.003))


# -- real data


@pytest.mark.parametrize(
    ("name", "expected"), [("ycbv", (21, 7, 7, 6)), ("bunny", (1, 1, 24, 1))], ids=["ycbv", "bunny"]
)
def test_real_data_is_taken_in_once(database, files, shared_data, name, expected):
    assert added(import_dataset(database, files, shared_data / name)) == expected
    before = everything(database, files)
    assert added(import_dataset(database, files, shared_data / name)) == (0, 0, 0, 0)
    assert everything(database, files) == before


# -- again, and more of it


def test_repeating_an_import_changes_nothing(database, files, demo):
    first = import_dataset(database, files, demo)
    before = everything(database, files)
    again = import_dataset(database, files, demo)
    assert added(again) == (0, 0, 0, 0) and again.dataset_id == first.dataset_id
    assert everything(database, files) == before


def test_under_another_name_it_is_another_dataset(database, files, demo):
    first = import_dataset(database, files, demo)
    second = import_dataset(database, files, demo, name="copy")
    assert added(second) == added(first) and second.dataset_id != first.dataset_id
    with database.read() as session:
        assert set(session.scalars(select(Dataset.name))) == {NAME, "copy"}


def test_a_dataset_that_has_grown_adds_only_what_is_new(database, files, demo_copy):
    import_dataset(database, files, demo_copy)
    for kind in ("depth", "rgb"):
        folder = demo_copy / UNPOSED_SCENE / kind
        shutil.copy(folder / "000000.png", folder / "000009.png")
    truth = gt_entry(TOOL, true_pose(TOOL, posed=False))
    change_json(
        demo_copy / UNPOSED_SCENE / "scene_camera.json", lambda c: c.update({"9": camera_entry(CAMERA, 0.1)})
    )
    change_json(demo_copy / UNPOSED_SCENE / "scene_gt.json", lambda truths: truths.update({"9": [truth]}))
    files_before = everything(database, files)[1]
    assert added(import_dataset(database, files, demo_copy)) == (0, 1, 1, 1)
    assert everything(database, files)[1] == files_before  # the pictures were there already


CONFLICTS: dict[str, tuple[Callable[[Path], object], str]] = {
    "mesh": (
        lambda root: trimesh.creation.box((41, 60, 60)).export(root / f"models/obj_{BLOCK:06d}.ply"),
        f"object {BLOCK} with another mesh",
    ),
    "symmetry": (
        lambda root: change_json(
            root / "models/models_info.json",
            lambda infos: infos[str(BLOCK)].update(symmetries_continuous=[{"axis": [0, 0, 1]}]),
        ),
        f"object {BLOCK} with another mesh or other symmetries",
    ),
    "depth": (
        lambda root: shutil.copy(
            root / POSED_SCENE / "depth/000000.png", root / POSED_SCENE / "depth/000005.png"
        ),
        "image 5 of scene 1 with other content",
    ),
    "camera": (
        lambda root: change_json(
            root / UNPOSED_SCENE / "scene_camera.json",
            lambda cameras: cameras["0"].update(cam_K=[301.0, 0, 159.5, 0, 300.0, 119.5, 0, 0, 1]),
        ),
        "image 0 of scene 2 › frame 0 with other content",
    ),
}


@pytest.mark.parametrize("case", CONFLICTS)
def test_what_contradicts_an_earlier_import_is_refused(database, files, demo_copy, case):
    spoil, message = CONFLICTS[case]
    import_dataset(database, files, demo_copy)
    spoil(demo_copy)
    (demo_copy / UNPOSED_SCENE).rename(demo_copy / "test/000003")  # new, but not to be taken in by halves
    if case == "camera":
        (demo_copy / "test/000003").rename(demo_copy / UNPOSED_SCENE)
    before = everything(database, files)
    with pytest.raises(ValueError, match=message) as caught:
        import_dataset(database, files, demo_copy)
    assert "--name" in str(caught.value)
    assert everything(database, files)[0] == before[0]  # a stored file that no row names is invisible


# -- what is not sound


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-40])


def rescale(path: Path, factor: float) -> None:
    mesh = trimesh.load(path, process=False)
    mesh.apply_scale(factor)
    mesh.export(path)


MESH_OF_TOOL = f"models/obj_{TOOL:06d}.ply"
PLY = "ply\nformat ascii 1.0\nelement vertex {n}\nproperty float x\nproperty float y\nproperty float z\n"
EMPTY_MESH = PLY.format(n=0) + "element face 0\nproperty list uchar int vertex_indices\nend_header\n"
NAN_MESH = (
    PLY.format(n=3)
    + "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\nnan 0 50\n0 50 0\n3 0 1 2\n"
)
THREAD_MESH = (
    PLY.format(n=3)
    + "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    + "0 0 0\n120 0 0\n60 0.001 0\n3 0 1 2\n"
)
CAMERAS, TRUTHS = f"{POSED_SCENE}/scene_camera.json", f"{POSED_SCENE}/scene_gt.json"

UNSOUND: dict[str, tuple[Callable[[Path], object], list[str]]] = {
    "a missing depth image": (
        lambda root: (root / POSED_SCENE / "depth/000005.png").unlink(),
        [f"{POSED_SCENE}/depth/000005.png", "missing", "add the file"],
    ),
    "a broken PNG": (
        lambda root: truncate(root / POSED_SCENE / "depth/000005.png"),
        [f"{POSED_SCENE}/depth/000005.png", "decoded", "replace the file"],
    ),
    "an intrinsics matrix of 8 numbers": (
        lambda root: change_json(root / CAMERAS, lambda c: c["5"].update(cam_K=[1.0] * 8)),
        [CAMERAS, "image 5", "cam_K", "9 numbers", "it has 8"],
    ),
    "a depth scale of 0": (
        lambda root: change_json(root / CAMERAS, lambda c: c["5"].update(depth_scale=0)),
        [CAMERAS, "image 5", "depth_scale", "above 0", "it is 0"],
    ),
    "an unknown obj_id": (
        lambda root: change_json(root / TRUTHS, lambda c: c["5"][0].update(obj_id=99)),
        [TRUTHS, "image 5", "obj_id 99", "models/obj_000099.ply"],
    ),
    "an empty mesh": (
        lambda root: (root / MESH_OF_TOOL).write_text(EMPTY_MESH),
        [MESH_OF_TOOL, "empty", "replace the file"],
    ),
    "a NaN in a mesh": (
        lambda root: (root / MESH_OF_TOOL).write_text(NAN_MESH),
        [MESH_OF_TOOL, "NaN", "replace the file"],
    ),
    "a mesh that is nearly a line": (
        lambda root: (root / MESH_OF_TOOL).write_text(THREAD_MESH),
        [MESH_OF_TOOL, "too thin beside its extent", "replace the file"],
    ),
    "a mesh in metres": (
        lambda root: rescale(root / MESH_OF_TOOL, 0.001),
        [MESH_OF_TOOL, "millimetres"],
    ),
    "pictures of two sizes": (
        lambda root: Image.new("RGB", (32, 24)).save(root / POSED_SCENE / "rgb/000005.png"),
        [f"{POSED_SCENE}/rgb/000005.png", "32x24", "320x240"],
    ),
    "no scene": (lambda root: shutil.rmtree(root / "test"), ["no scene", "test/000001"]),
    "no folder": (shutil.rmtree, ["is no folder"]),
}


@pytest.mark.parametrize("again", [False, True], ids=["first import", "second import"])
@pytest.mark.parametrize("case", UNSOUND)
def test_an_unsound_dataset_gets_one_sentence_and_leaves_nothing(
    database, files, demo, demo_copy, case, again
):
    if again:
        import_dataset(database, files, demo)
    before = everything(database, files)
    spoil, fragments = UNSOUND[case]
    spoil(demo_copy)
    with pytest.raises(ValueError) as caught:
        import_dataset(database, files, demo_copy)
    message = str(caught.value)
    assert "\n" not in message and all(fragment in message for fragment in fragments), message
    assert everything(database, files) == before


def test_progress_is_told(database, files, demo):
    told: list[tuple[float, str]] = []
    import_dataset(database, files, demo, progress=lambda *report: told.append(report))
    shares = [share for share, _ in told]
    assert shares == sorted(shares) and shares[-1] == 1.0
    assert any("image 5" in what for _, what in told)


def test_a_name_that_is_too_long_is_refused(database, files, demo):
    before = everything(database, files)
    with pytest.raises(ValueError, match="name may have 200 characters; this one has 201"):
        import_dataset(database, files, demo, name="n" * 201)
    assert everything(database, files) == before
