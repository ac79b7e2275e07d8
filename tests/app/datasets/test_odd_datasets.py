"""Inputs of the kinds that people reported: what a sound dataset is turned into, and what comes of it."""

import json
import os
import shutil
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from sqlalchemy import select

from app.datasets.archives import import_archive
from app.datasets.importing import import_dataset
from app.storage.tables import Frame, Object, Task
from registration_core.bop.writer import gt_entry
from registration_core.geometry import pose
from tests.app.export.labelled import labelled_export
from tests.app.imports import everything
from tests.app.small_dataset import (
    BLOCK,
    NEAR_VIEW,
    POSED_SCENE,
    TOOL,
    UNPOSED_SCENE,
    change_json,
    true_pose,
)

MEGABYTES = 64 * 2**20
MESH = f"models/obj_{BLOCK:06d}.ply"
PICTURE = f"{UNPOSED_SCENE}/rgb/000000.png"
DEPTH = f"{UNPOSED_SCENE}/depth/000000.png"
CAMERAS, TRUTHS = f"{POSED_SCENE}/scene_camera.json", f"{POSED_SCENE}/scene_gt.json"

Change = Callable[[Path], object]


# -- meshes


def as_polygons(root: Path) -> None:
    """A box of six squares, in ASCII, with type names that few use and a property before the corners."""
    box = trimesh.load(root / MESH, process=False)
    low, high = box.bounds
    corners = [[(high, low)[not bit][axis] for axis, bit in enumerate(bits)] for bits in np.ndindex(2, 2, 2)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    lines = ["ply", "format ascii 1.0", "element vertex 8"]
    lines += [f"property float64 {axis}" for axis in "xyz"]
    lines += [
        "element face 6",
        "property uint8 flags",
        "property list uint16 uint32 vertex_index",
        "end_header",
    ]
    lines += [" ".join(map(str, corner)) for corner in corners]
    lines += [f"7 4 {' '.join(map(str, side))}" for side in sides]
    (root / MESH).write_text("\r\n".join(lines) + "\r\n")


def with_far_vertex(root: Path) -> None:
    """A vertex a kilometre away that no triangle uses."""
    mesh = trimesh.load(root / MESH, process=False)
    vertices = np.vstack([mesh.vertices, [[1e6, 0, 0]]])
    trimesh.Trimesh(vertices, mesh.faces, process=False).export(root / MESH)


def with_texture(name: str, mode: str) -> Change:
    """Texture coordinates at the vertices, under names that others use, and a picture beside."""

    def change(root: Path) -> None:
        mesh = trimesh.load(root / MESH, process=False)
        lines = [b"ply", b"format binary_big_endian 1.0", f"comment TextureFile {name}".encode()]
        lines += [f"element vertex {len(mesh.vertices)}".encode()]
        lines += [b"property float " + axis for axis in (b"x", b"y", b"z", b"s", b"t")]
        lines += [f"element face {len(mesh.faces)}".encode(), b"property list uchar int vertex_indices"]
        rows = [struct.pack(">5f", *vertex, 0.25, 0.75) for vertex in mesh.vertices]
        rows += [struct.pack(">B3i", 3, *face) for face in mesh.faces]
        (root / MESH).write_bytes(b"\n".join([*lines, b"end_header\n"]) + b"".join(rows))
        picture = Image.new("RGB", (8, 8), (10, 200, 30)).convert(mode)
        picture.save(root / "models/skin.png")

    return change


@pytest.mark.parametrize(
    "change",
    [
        as_polygons,
        with_far_vertex,
        with_texture("skin.png", "RGBA"),
        with_texture("C:\\Users\\me\\skin.png", "P"),
        with_texture("../textures/skin.png", "LA"),
    ],
    ids=["polygons", "unused vertex", "texture with alpha", "texture of a palette", "texture elsewhere"],
)
def test_a_mesh_of_any_form_is_the_same_object(demo, demo_copy, tmp_path, change):
    change(demo_copy)
    folder = labelled_export(demo_copy, tmp_path)
    mesh = trimesh.load(folder / MESH, process=False)
    original = trimesh.load(demo / MESH, process=False)
    assert np.allclose(mesh.bounds, original.bounds, atol=1e-3)
    assert mesh.area == pytest.approx(original.area, rel=1e-5)
    if mesh.visual.kind == "texture":
        with Image.open(folder / f"models/obj_{BLOCK:06d}.png") as picture:
            assert picture.mode in ("L", "RGB")


def test_a_texture_that_is_missing_is_said(database, files, demo_copy):
    with_texture("skin.png", "RGB")(demo_copy)
    (demo_copy / "models/skin.png").unlink()
    (warning,) = import_dataset(database, files, demo_copy).warnings
    assert f"obj_{BLOCK:06d}.ply" in warning.text and "skin.png" in warning.text
    with database.read() as session:
        assert set(session.scalars(select(Object.texture_hash))) == {None}


# -- pictures


def turned(root: Path) -> None:
    """Stored on its side, with the tag that tells."""
    with Image.open(root / PICTURE) as picture:
        on_its_side = picture.transpose(Image.Transpose.ROTATE_90)
    exif = Image.Exif()
    exif[0x0112] = 6
    on_its_side.save(root / PICTURE, exif=exif)


def grey_16(root: Path) -> None:
    grey = np.asarray(Image.open(root / PICTURE).convert("L")).astype(np.uint16) * 257
    Image.fromarray(grey).save(root / PICTURE)


def saved_as(suffix: str, mode: str) -> Change:
    def change(root: Path) -> None:
        with Image.open(root / PICTURE) as picture:
            picture.convert(mode).save((root / PICTURE).with_suffix(suffix))
        if suffix != ".png":
            (root / PICTURE).unlink()

    return change


@pytest.mark.parametrize(
    ("change", "is_grey"),
    [
        (turned, False),
        (grey_16, True),
        (saved_as(".png", "P"), False),
        (saved_as(".JPG", "CMYK"), False),
        (saved_as(".tiff", "RGBA"), False),
        (saved_as(".png", "1"), True),
    ],
    ids=["turned", "16 bits", "palette", "CMYK", "alpha", "1 bit"],
)
def test_a_picture_of_any_form_is_kept_plain(database, files, demo, demo_copy, change, is_grey):
    change(demo_copy)
    (source,) = (demo_copy / PICTURE).parent.iterdir()
    assert import_dataset(database, files, demo_copy).warnings == ()
    with database.read() as session:
        (kept,) = session.scalars(select(Frame.color_hash).where(~Frame.posed))
    with Image.open(files.path(kept)) as picture, Image.open(demo / PICTURE) as original:
        assert (picture.mode, picture.size) == ("L" if is_grey else "RGB", original.size)
        assert picture.format in ("PNG", "JPEG") and not dict(picture.getexif())
        with Image.open(demo / PICTURE if change in (turned, grey_16) else source) as given:
            wanted = given.convert(picture.mode)
        assert np.array_equal(np.asarray(picture), np.asarray(wanted))


def test_depth_under_a_wrong_ending_is_exported_as_what_it_says(demo_copy, tmp_path):
    raw = Image.open(demo_copy / DEPTH)
    raw.load()
    raw.save(demo_copy / DEPTH, format="TIFF")
    exported = labelled_export(demo_copy, tmp_path)
    with Image.open(exported / DEPTH) as depth:
        assert depth.format == "PNG" and np.array_equal(np.asarray(depth), np.asarray(raw))


# -- refused


def twice(path: str, other: str) -> Change:
    def change(root: Path) -> None:
        (root / other).parent.mkdir(exist_ok=True)
        copy = shutil.copytree if (root / path).is_dir() else shutil.copyfile
        copy(root / path, root / other)

    return change


def renamed(path: str, other: str) -> Change:
    return lambda root: (root / path).rename(root / other)


def pipe(path: str) -> Change:
    def change(root: Path) -> None:
        (root / path).unlink()
        os.mkfifo(root / path)

    return change


def named(name: str) -> Change:
    return lambda root: (root / "models/names.json").write_text(json.dumps({str(BLOCK): name}))


def text_twice(path: str, key: str) -> Change:
    def change(root: Path) -> None:
        text = (root / path).read_text()
        (root / path).write_text(text.replace(f'"{key}"', f'"{key}": 1, "{key}"', 1))

    return change


def floating_depth(root: Path) -> None:
    depth = np.asarray(Image.open(root / DEPTH)).astype(np.float32) / 1e4
    (root / DEPTH).unlink()
    Image.fromarray(depth).save((root / DEPTH).with_suffix(".tif"))


def large_depth(root: Path) -> None:
    raw = np.asarray(Image.open(root / DEPTH)).astype(np.int32) * 100
    (root / DEPTH).unlink()
    Image.fromarray(raw).save((root / DEPTH).with_suffix(".tif"))


def images_one_by_one(root: Path) -> None:
    shutil.rmtree(root / "test")
    twice(MESH, "val/000000_000000.camera.json")(root)


def packed_scenes(root: Path) -> None:
    shutil.rmtree(root / "test")
    (root / "test.zip").write_bytes(b"PK")


def with_depth_scale(scale: float) -> Change:
    """In every image of every scene."""

    def change(root: Path) -> None:
        for path in root.rglob("scene_camera.json"):
            change_json(path, lambda c: [entry.update(depth_scale=scale) for entry in c.values()])

    return change


REFUSED: dict[str, tuple[Change, list[str]]] = {
    "one scene under two names": (twice(POSED_SCENE, "test/1"), ["test/000001", "test/1", "one scene"]),
    "one object under two names": (twice(MESH, f"models/obj_{BLOCK}.ply"), [f"both object {BLOCK}"]),
    "one picture in two forms": (
        twice(PICTURE, PICTURE.replace("png", "jpg")),
        ["000000.jpg", "both image 0"],
    ),
    "a field twice": (text_twice(CAMERAS, "cam_K"), [CAMERAS, '"cam_K" twice']),
    "an instance's field twice": (text_twice(TRUTHS, "obj_id"), [TRUTHS, '"obj_id" twice']),
    "a picture that is not read": (renamed(PICTURE, PICTURE.replace("png", "webp")), ["000000.webp", ".png"]),
    "depth that is not read": (renamed(DEPTH, DEPTH.replace("png", "exr")), ["000000.exr", ".tif"]),
    "depth in floating point": (floating_depth, ["depth/000000.tif", "16-bit"]),
    "depth beyond 16 bits": (large_depth, ["depth/000000.tif", "65535"]),
    "a pipe for JSON": (pipe(CAMERAS), [CAMERAS, "is no file"]),
    "a pipe for depth": (pipe(DEPTH), [DEPTH, "missing"]),
    "a pipe for a mesh": (pipe(MESH), [f"obj_id {BLOCK} is unknown"]),
    "a name of NUL": (named("a\0b"), ["models/names.json", "readable"]),
    "a name of half a character": (named("\ud800"), ["models/names.json", "readable"]),
    "a name of 201 characters": (named("x" * 201), ["models/names.json", "200"]),
    "a scene's number of 12 digits": (renamed(POSED_SCENE, "test/123456789012"), ["9 digits"]),
    "a scene's number in other digits": (renamed(POSED_SCENE, "test/²"), ["test/²", "digits"]),
    "an image's number of 12 digits": (
        lambda root: change_json(root / CAMERAS, lambda c: c.update({"1" * 12: c.pop("5")})),
        [CAMERAS, "9 digits"],
    ),
    "a split's name of 60 characters": (renamed("test", "t" * 60), ["50 readable"]),
    "meshes of another suffix": (renamed("models", "models_fine"), ["models has no mesh", "models_fine"]),
    "images one by one": (
        images_one_by_one,
        ["no scene", "val", "single images"],
    ),
    "files by sensor": (
        lambda root: [
            path.rename(path.with_name(path.stem + "_photoneo" + path.suffix))
            for path in (root / POSED_SCENE).iterdir()
        ],
        [POSED_SCENE, "scene_camera_photoneo.json", "_photoneo"],
    ),
    "packed scenes": (
        packed_scenes,
        ["no scene", "unpack test.zip"],
    ),
    "depth in micrometres": (
        with_depth_scale(1e-4),
        ["depth_scale 0.0001", "import with depth scale"],
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_right_is_refused_with_the_reason(database, files, demo_copy, case):
    change, words = REFUSED[case]
    change(demo_copy)
    before = everything(database, files)
    with pytest.raises(ValueError) as caught:
        import_dataset(database, files, demo_copy)
    message = str(caught.value)
    assert "\n" not in message and all(word in message for word in words), message
    assert everything(database, files) == before


# -- odd


def all_cameras(**fields: object) -> Change:
    return lambda root: change_json(
        root / CAMERAS, lambda cameras: [entry.update(fields) for entry in cameras.values()]
    )


def moved_in_one_image(root: Path) -> None:
    def move(truths: dict) -> None:
        truths["5"][1]["cam_t_m2c"][0] += 150

    change_json(root / TRUTHS, move)


ODD: dict[str, tuple[Change, list[str]]] = {
    "cameras that stand still": (
        all_cameras(cam_R_w2c=[1, 0, 0, 0, 1, 0, 0, 0, 1], cam_t_w2c=[0, 0, 0]),
        ["the picture has moved", "image 5"],
    ),
    "an object moved in one image": (moved_in_one_image, [f"object {BLOCK} hovers", "image 5"]),
    "a camera matrix of another resolution": (
        lambda root: change_json(
            root / CAMERAS, lambda c: c["5"].update(cam_K=[1200.0, 0, 640.0, 0, 1200.0, 480.0, 0, 0, 1])
        ),
        ["principal point (640, 480)", "320x240", "image 5"],
    ),
    "a focal length in millimetres": (
        lambda root: change_json(
            root / CAMERAS, lambda c: c["5"].update(cam_K=[4.0, 0, 160.0, 0, 4.0, 120.0, 0, 0, 1])
        ),
        ["focal lengths (4, 4 pixels)", "image 5"],
    ),
    "depth ten times too near": (
        with_depth_scale(0.01),
        ["far behind what the depth image shows", "depth_scale"],
    ),
    "a picture that is missing": (
        lambda root: (root / POSED_SCENE / "rgb/000005.png").unlink(),
        ["no picture", "image 5"],
    ),
}


@pytest.mark.parametrize("case", ODD)
def test_what_may_be_right_is_taken_and_said(database, files, demo_copy, case):
    change, words = ODD[case]
    change(demo_copy)
    said = [
        f"{warning.text} {warning.images}" for warning in import_dataset(database, files, demo_copy).warnings
    ]
    assert any(all(word in text for word in words) for text in said), said


def test_a_sound_dataset_is_taken_without_a_word(database, files, demo):
    assert import_dataset(database, files, demo).warnings == ()


@pytest.mark.parametrize("name", ["ycbv", "bunny", "moro", "apc", "rbt"])
def test_real_scenes_are_taken_without_a_word(database, files, shared_data, name):
    assert import_dataset(database, files, shared_data / name).warnings == ()


# -- copies


def test_copies_are_matched_wherever_they_are_listed(database, files, demo_copy):
    """A second block beside the first, listed before it in one image and after it in the other."""
    aside = pose.from_rotation_translation(np.eye(3), [0.15, 0.0, 0.0]) @ true_pose(BLOCK)
    T_camera_world = {"0": pose.inverse(NEAR_VIEW)}

    def add(truths: dict) -> None:
        truths["0"].append(gt_entry(BLOCK, T_camera_world["0"] @ aside))
        first = truths["0"][1]
        T_side = np.eye(4)
        T_side[:3, :3] = np.reshape(truths["5"][1]["cam_R_m2c"], (3, 3))
        T_side[:3, 3] = np.array(truths["5"][1]["cam_t_m2c"]) / 1000
        T_near = T_camera_world["0"] @ true_pose(BLOCK)
        assert first["obj_id"] == BLOCK
        truths["5"].insert(0, gt_entry(BLOCK, T_side @ pose.inverse(T_near) @ T_camera_world["0"] @ aside))

    change_json(demo_copy / TRUTHS, add)
    import_dataset(database, files, demo_copy)
    with database.read() as session:
        query = select(Task).join(Task.scene).join(Task.object).where(Object.obj_id == BLOCK)
        references = [
            np.array(task.T_world_object_reference)
            for task in session.scalars(query.order_by(Task.instance))
            if task.frame.posed
        ]
    assert len(references) == 2
    assert np.allclose(references[0], true_pose(BLOCK), atol=1e-6)
    assert np.allclose(references[1], aside, atol=1e-6)


def test_an_object_that_hides_behind_many_names_no_task_twice(database, files, demo_copy):
    """Images list only what they show: the block alone in one, the tool alone in the other."""
    change_json(demo_copy / TRUTHS, lambda t: (t["0"].pop(0), t["5"].pop(1)))
    import_dataset(database, files, demo_copy)
    with database.read() as session:
        tasks = [task for task in session.scalars(select(Task)) if task.frame.posed]
        found = {(task.object.obj_id, task.instance) for task in tasks}
    assert found == {(TOOL, 0), (BLOCK, 0)}


# -- archives


def pack(folder: Path, archive: Path, *extra: str, prefix: str = "") -> Path:
    with zipfile.ZipFile(archive, "w") as target:
        for path in sorted(folder.rglob("*")):
            if path.is_file():
                target.write(path, prefix + path.relative_to(folder).as_posix())
        for name in extra:
            target.writestr(name, b"x")
    return archive


@pytest.mark.parametrize(
    ("prefix", "extra"),
    [
        ("a/b/c/tools/", ()),
        (
            "tools/",
            (".DS_Store", "tools/.DS_Store", "__MACOSX/tools/._models", "tools/models/._obj_000001.ply"),
        ),
        ("tools/", ("Thumbs.db", "tools/desktop.ini", "tools/test/Thumbs.db", "LICENSE", "docs/notes.md")),
        ("tools/", ("tools/output/2024/poses.csv", "tools/results/7/log.txt")),
    ],
    ids=["deep", "Finder", "Explorer", "numbered results"],
)
def test_a_dataset_is_found_in_any_sane_archive(database, files, demo, tmp_path, prefix, extra):
    archive = pack(demo, tmp_path / "x.zip", *extra, prefix=prefix)
    summary = import_archive(database, files, archive, "upload", MEGABYTES)
    assert (summary.name, summary.tasks) == ("tools", 4)


def test_two_datasets_in_one_archive_are_named(database, files, demo, tmp_path):
    archive = pack(demo, tmp_path / "x.zip", prefix="one/")
    with zipfile.ZipFile(archive, "a") as target:
        for path in demo.rglob("*"):
            if path.is_file():
                target.write(path, f"two/{path.relative_to(demo).as_posix()}")
    with pytest.raises(ValueError, match="2 datasets \\(one, two\\)"):
        import_archive(database, files, archive, "upload", MEGABYTES)


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize("again", [MESH, MESH.replace("/", "\\")], ids=["same", "other separator"])
def test_an_entry_that_is_there_twice_is_named(database, files, demo, tmp_path, again):
    archive = pack(demo, tmp_path / "x.zip", again)
    with pytest.raises(ValueError, match=f"{MESH}' twice"):
        import_archive(database, files, archive, "upload", MEGABYTES)
