"""Datasets that people reported problems with, rebuilt small: each comes out right, or is told plainly."""

import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from sqlalchemy import select

from app.datasets.archives import import_archive
from app.datasets.importing import import_dataset
from app.storage.tables import Dataset, Frame, Task
from tests.app.export.labelled import labelled_export
from tests.app.imports import everything

MEGABYTES = 64 * 2**20
EXTENTS = (40.0, 25.0, 25.0)
"""Half of the block's sides, mm."""

TAKEN = {
    "04-texture-per-face": 1,
    "05-quads": 1,
    "07-big-endian": 1,
    "34-png-exif-orientation-6": 1,
    "37-itodd-tif": 1,
    "38-colour-tif-only": 1,
    "41-colour-with-alpha": 1,
    "49-copies-listed-per-view": 2,
    "50-each-view-its-own-copy": 2,
    "61-zip-folder-in-folder": 1,
    "62-zip-readme-beside-folder": 1,
    "65-json-with-BOM": 1,
    "70-other-numbered-folder": 1,
    "73-one-grey-picture-in-rgb": 1,
}
"""How many tasks they are."""

REFUSED = {
    "16-tristrips": ["models/obj_000001.ply", "triangle strips"],
    "19-models_cad-only": ["models has no mesh", "models_cad and models_eval"],
    "22-depth-scale-in-metres": ["0.0006", "depth_scale 0.001", "import with depth scale 1"],
    "23-depth-scale-1000": ["depth_scale 1000", "import with depth scale 1"],
    "32-same-image-under-two-keys": ["test/000001/scene_gt.json", "0 twice"],
    "67-webdataset-shards": ["no scene", "train_web", "webdataset shards", "shard-000000.tar"],
    "68-files-by-camera": ["test/000001", "scene_camera_cam1.json"],
    "74-two-meshes-of-one-id": ["obj_01.ply", "obj_000001.ply", "both object 1"],
    "77-same-key-twice": ["test/000001/scene_camera.json", '"0" twice'],
}

ODD = {
    "29-c2w-written-as-w2c": (["object 1", "image 0", "camera to world"], ["test/000001, image 1"]),
    "55-pose-in-opengl-axes": (["object 1", "behind the camera", "OpenGL"], ["test/000001, image 0"]),
}


@pytest.mark.parametrize("case", TAKEN)
def test_taken_without_a_word(database, files, shared_cases, case):
    summary = import_dataset(database, files, shared_cases / case)
    assert (summary.tasks, summary.warnings) == (TAKEN[case], ())


@pytest.mark.parametrize("case", REFUSED)
def test_refused_with_the_reason(database, files, shared_cases, case):
    before = everything(database, files)
    with pytest.raises(ValueError) as caught:
        import_dataset(database, files, shared_cases / case)
    message = str(caught.value)
    assert "\n" not in message and all(words in message for words in REFUSED[case]), message
    assert everything(database, files) == before


@pytest.mark.parametrize("case", ODD)
def test_taken_with_a_warning_that_names_images(database, files, shared_cases, case):
    words, images = ODD[case]
    summary = import_dataset(database, files, shared_cases / case)
    with database.read() as session:
        (warning,) = session.scalars(select(Dataset.warnings)).one()
    assert all(word in warning["text"] for word in words), warning
    assert warning["images"] == images and not warning["accepted"]
    assert [warning["text"]] == [told.text for told in summary.warnings]


@pytest.mark.parametrize("case", ["22-depth-scale-in-metres", "23-depth-scale-1000"])
def test_the_suggested_depth_scale_will_do(database, files, shared_cases, case):
    assert import_dataset(database, files, shared_cases / case, depth_scale=1.0).tasks == 1
    with database.read() as session:
        assert session.scalars(select(Frame.depth_scale)).one() == 1.0


def test_each_copy_has_its_own_reference(database, files, shared_cases):
    import_dataset(database, files, shared_cases / "49-copies-listed-per-view")
    with database.read() as session:
        a, b = (np.array(task.T_world_object_reference) for task in session.scalars(select(Task)))
    assert np.linalg.norm(a[:3, 3] - b[:3, 3]) == pytest.approx(0.150, abs=0.002)


@pytest.mark.parametrize(
    ("case", "prefix", "readme"),
    [("61-zip-folder-in-folder", "outer/inner/", False), ("62-zip-readme-beside-folder", "inner/", True)],
)
@pytest.mark.parametrize("separator", ["/", "\\"])
def test_a_dataset_is_found_in_its_archive(
    database, files, shared_cases, tmp_path, case, prefix, readme, separator
):
    archive = tmp_path / "upload.zip"
    with zipfile.ZipFile(archive, "w") as target:
        for path in sorted((shared_cases / case).rglob("*")):
            if path.is_file():
                name = prefix + path.relative_to(shared_cases / case).as_posix()
                target.write(path, name.replace("/", separator))
        if readme:
            target.writestr("README.txt", "Read me.")
    summary = import_archive(database, files, archive, "upload", MEGABYTES)
    assert (summary.name, summary.tasks) == ("inner", 1)


@pytest.mark.parametrize("case", ["04-texture-per-face", "05-quads", "07-big-endian"])
def test_every_mesh_is_exported_in_a_form_that_all_tools_read(shared_cases, tmp_path, case):
    folder = labelled_export(shared_cases / case, tmp_path)
    lines = (folder / "models/obj_000001.ply").read_bytes().partition(b"end_header")[0].decode().splitlines()
    assert lines[1] == "format binary_little_endian 1.0"
    assert {line.split()[1] for line in lines if line.startswith("property")} <= {"float", "uchar", "list"}
    mesh = trimesh.load(folder / "models/obj_000001.ply", process=False)
    assert len(mesh.faces) == 36
    assert np.allclose(mesh.bounds, np.array([np.negative(EXTENTS), EXTENTS]))


def test_a_texture_comes_along(shared_cases, tmp_path):
    case = shared_cases / "04-texture-per-face"
    folder = labelled_export(case, tmp_path)
    mesh = trimesh.load(folder / "models/obj_000001.ply", process=False)
    assert mesh.visual.uv.shape == (len(mesh.vertices), 2)
    wanted = np.asarray(Image.open(case / "models/obj_000001.png").convert("RGB"))
    assert np.array_equal(np.asarray(mesh.visual.material.image.convert("RGB")), wanted)
    again = import_elsewhere(folder, tmp_path)
    assert (again / "models/obj_000001.png").is_file()


def import_elsewhere(dataset: Path, folder: Path) -> Path:
    """Another way round: what was exported is imported and exported again."""
    (folder / "again").mkdir()
    return labelled_export(dataset, folder / "again")


def test_nothing_is_printed_of_a_mesh_that_is_taken(database, files, shared_cases, capfd):
    import_dataset(database, files, shared_cases / "04-texture-per-face")
    printed = capfd.readouterr()
    assert printed.out + printed.err == ""


@pytest.mark.parametrize("case", ["34-png-exif-orientation-6", "41-colour-with-alpha", "38-colour-tif-only"])
def test_a_picture_is_kept_plain(database, files, shared_cases, tmp_path, case):
    """The pixels as they are stored, and nothing that a reader may take into account or not."""
    import_dataset(database, files, shared_cases / case)
    (source,) = (shared_cases / case / "test/000001/rgb").iterdir()
    with database.read() as session:
        kept = files.path(session.scalars(select(Frame.color_hash)).one())
    with Image.open(kept) as picture, Image.open(source) as original:
        assert (picture.mode, picture.size, picture.format) == ("RGB", (320, 240), "PNG")
        assert dict(picture.getexif()) == {}
        assert np.array_equal(np.asarray(picture), np.asarray(original)[..., :3])
    exported = labelled_export(shared_cases / case, tmp_path)
    assert (exported / "test/000001/rgb/000000.png").read_bytes() == kept.read_bytes()


def test_pictures_of_one_scene_are_exported_together(shared_cases, tmp_path):
    scene = labelled_export(shared_cases / "73-one-grey-picture-in-rgb", tmp_path) / "test/000001"
    assert sorted(path.name for path in (scene / "rgb").iterdir()) == ["000000.png", "000001.png"]
    assert not (scene / "gray").exists()


def test_depth_of_another_format_is_exported_as_png(shared_cases, tmp_path):
    case = shared_cases / "37-itodd-tif"
    scene = labelled_export(case, tmp_path) / "test/000001"
    raw = np.asarray(Image.open(case / "test/000001/depth/000000.tif"))
    with Image.open(scene / "depth/000000.png") as depth:
        assert (depth.format, depth.mode) == ("PNG", "I;16")
        assert np.array_equal(np.asarray(depth), raw)
    assert [path.name for path in (scene / "gray").iterdir()] == ["000000.png"]


def test_what_was_odd_stays_accepted_when_it_is_imported_again(database, files, shared_cases):
    case = shared_cases / "55-pose-in-opengl-axes"
    import_dataset(database, files, case)
    with database.write() as session:
        dataset = session.scalars(select(Dataset)).one()
        dataset.warnings = [{**warning, "accepted": True} for warning in dataset.warnings]
    import_dataset(database, files, case)
    with database.read() as session:
        (warning,) = session.scalars(select(Dataset.warnings)).one()
    assert warning["accepted"]
