import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from registration_core.bop import writer as bop_writer
from registration_core.bop.dataset import BopFormatError, BopImage, read_color, read_dataset, read_depth
from registration_core.geometry import pose
from registration_core.geometry.camera import Intrinsics
from registration_core.geometry.object_model import ContinuousSymmetry, ObjectModel, Symmetries
from registration_core.geometry.pose_error import add
from registration_core.rendering.rasterizer import render_depth

CAMERA = Intrinsics(width=32, height=24, fx=40.0, fy=41.0, cx=15.5, cy=11.5)
T_WORLD_CAMERA = pose.exp([0.1, -0.2, 0.8, 0.3, -0.4, 0.5])
T_CAMERA_OBJECT = pose.exp([0.01, 0.02, 0.6, 0.2, 0.3, -0.1])
SYMMETRIES = Symmetries(
    discrete=(tuple(map(tuple, pose.exp([0.01, 0.0, 0.0, 0.0, 0.0, np.pi]).tolist())),),
    continuous=(ContinuousSymmetry((0.0, 0.0, 1.0), (0.002, 0.0, 0.0)),),
)
SCENE = "test/000001"


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    """A small dataset without fault: two images, one object."""
    root = tmp_path / "small"
    mesh = trimesh.creation.box((0.06, 0.08, 0.1))
    bop_writer.write_mesh(root / "models/obj_000007.ply", mesh)
    model = ObjectModel(np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int32), SYMMETRIES)
    bop_writer.write_json(root / "models/models_info.json", {7: bop_writer.model_info(model)})
    bop_writer.write_json(root / "models/names.json", {7: "tea box"})
    entry = bop_writer.camera_entry(CAMERA, 0.1, T_WORLD_CAMERA)
    bop_writer.write_json(root / SCENE / "scene_camera.json", {3: entry, 12: entry})
    bop_writer.write_json(root / SCENE / "scene_gt.json", {3: [bop_writer.gt_entry(7, T_CAMERA_OBJECT)]})
    for image_id in (3, 12):
        depth = np.full((24, 32), 0.6, dtype=np.float32)
        bop_writer.write_depth_png(root / SCENE / f"depth/{image_id:06d}.png", depth, 0.1)
        color = np.full((24, 32, 3), (10, 20, 30), dtype=np.uint8)
        bop_writer.write_color_png(root / SCENE / f"rgb/{image_id:06d}.png", color)
    return root


def test_what_was_written_is_read_back(dataset):
    read = read_dataset(dataset)
    assert read.name == "small"
    (known,) = read.objects
    assert (known.obj_id, known.name, known.mesh_path.name) == (7, "tea box", "obj_000007.ply")
    assert known.model.vertices.max(axis=0) == pytest.approx([0.03, 0.04, 0.05])
    assert np.allclose(known.model.symmetries.discrete, SYMMETRIES.discrete)
    assert known.model.symmetries.continuous == SYMMETRIES.continuous
    (scene,) = read.scenes
    assert (scene.scene_id, scene.split) == (1, "test")
    first, second = scene.images
    assert (first.image_id, second.image_id) == (3, 12)
    assert first.camera == CAMERA
    assert first.T_world_camera == pytest.approx(T_WORLD_CAMERA)
    assert first.ground_truth is not None and first.color is not None
    assert first.ground_truth[0].obj_id == 7
    assert first.ground_truth[0].T_camera_object == pytest.approx(T_CAMERA_OBJECT)
    assert second.ground_truth is None
    assert read_depth(first.depth.path, first.depth_scale) == pytest.approx(0.6)
    assert read_color(first.color.path)[0, 0].tolist() == [10, 20, 30]


def test_camera_poses_are_written_as_world_to_camera_in_millimetres():
    entry = bop_writer.camera_entry(CAMERA, 1.0, T_WORLD_CAMERA)
    R, t = np.reshape(entry["cam_R_w2c"], (3, 3)), np.array(entry["cam_t_w2c"])
    point_world = np.array([0.3, -0.2, 1.5])
    expected = pose.apply(pose.inverse(T_WORLD_CAMERA), point_world) * 1000.0
    assert R @ (point_world * 1000.0) + t == pytest.approx(expected)


def test_object_poses_are_written_as_model_to_camera_in_millimetres():
    entry = bop_writer.gt_entry(7, pose.from_rotation_translation(np.eye(3), [0.1, 0.2, 0.3]))
    assert entry == {
        "cam_R_m2c": [1, 0, 0, 0, 1, 0, 0, 0, 1],
        "cam_t_m2c": pytest.approx([100, 200, 300]),
        "obj_id": 7,
    }


def test_model_info_is_in_millimetres():
    box = trimesh.creation.box((0.06, 0.08, 0.1))
    info = bop_writer.model_info(ObjectModel(np.asarray(box.vertices), np.asarray(box.faces, dtype=np.int32)))
    assert info["diameter"] == pytest.approx(np.sqrt(6**2 + 8**2 + 10**2) * 10)
    assert (info["min_x"], info["size_z"]) == pytest.approx((-30, 100))
    assert "symmetries_discrete" not in info


def test_json_has_a_line_for_each_entry_in_the_order_given():
    assert bop_writer.json_text({2: {"a": [1]}, 10: []}) == '{\n  "2": {"a": [1]},\n  "10": []\n}\n'


@pytest.mark.parametrize("depth", [np.nan, -0.1, 7.0])
def test_depth_that_16_bits_cannot_hold_is_refused(tmp_path, depth):
    with pytest.raises(ValueError, match=r"from 0 to 6\.5535 m"):
        bop_writer.write_depth_png(tmp_path / "d.png", np.full((2, 2), depth), 0.1)
    assert not (tmp_path / "d.png").exists()


def test_what_is_optional_may_be_missing(dataset):
    (dataset / "models/models_info.json").unlink()
    (dataset / "models/names.json").unlink()
    (dataset / SCENE / "scene_gt.json").unlink()
    (dataset / SCENE / "rgb/000003.png").unlink()
    change(dataset, "scene_camera.json", lambda c: [c["3"].pop(k) for k in ("cam_R_w2c", "cam_t_w2c")])
    read = read_dataset(dataset)
    assert read.objects[0].name == "object 7"
    assert read.objects[0].model.symmetries == Symmetries()
    image = read.scenes[0].images[0]
    assert (image.color, image.T_world_camera, image.ground_truth) == (None, None, None)


def test_grey_jpeg_pictures_are_found(dataset):
    (dataset / SCENE / "rgb/000003.png").unlink()
    (dataset / SCENE / "gray").mkdir()
    Image.new("L", (32, 24), 77).save(dataset / SCENE / "gray/000003.jpg")
    image = read_dataset(dataset).scenes[0].images[0]
    assert image.color is not None
    assert image.color.path.name == "000003.jpg"
    assert read_color(image.color.path).shape == (24, 32, 3)


def test_every_split_with_numbered_folders_is_read(dataset):
    (dataset / SCENE).rename(dataset / "moved")
    (dataset / "val").mkdir()
    (dataset / "moved").rename(dataset / "val/000042")
    (dataset / "notes").mkdir()
    assert [(scene.split, scene.scene_id) for scene in read_dataset(dataset).scenes] == [("val", 42)]


def test_progress_rises_to_1(dataset):
    calls: list[tuple[float, str]] = []
    read_dataset(dataset, lambda share, what: calls.append((share, what)))
    shares = [share for share, _ in calls]
    assert shares == pytest.approx([1 / 3, 2 / 3, 1.0])
    assert [what for _, what in calls] == [
        "models/obj_000007.ply",
        "test/000001, image 3",
        "test/000001, image 12",
    ]


def change(root: Path, name: str, edit: Callable[[dict], object]) -> None:
    """Edit a JSON file of the dataset's scene (or of its models)."""
    path = root / ("models" if name in ("models_info.json", "names.json") else SCENE) / name
    content = json.loads(path.read_text())
    edit(content)
    path.write_text(json.dumps(content))


def edit_camera(**fields: object) -> Callable[[Path], None]:
    return lambda root: change(root, "scene_camera.json", lambda c: c["3"].update(fields))


def edit_truth(**fields: object) -> Callable[[Path], None]:
    return lambda root: change(root, "scene_gt.json", lambda c: c["3"][0].update(fields))


def edit_info(**fields: object) -> Callable[[Path], None]:
    return lambda root: change(root, "models_info.json", lambda c: c["7"].update(fields))


def replace(name: str, content: bytes) -> Callable[[Path], None]:
    return lambda root: (root / name).write_bytes(content)  # type: ignore[return-value]


def remove(name: str) -> Callable[[Path], None]:
    return lambda root: (root / name).unlink()


def save_image(name: str, image: Image.Image) -> Callable[[Path], None]:
    return lambda root: image.save(root / name)


def truncate(name: str) -> Callable[[Path], None]:
    return lambda root: (root / name).write_bytes((root / name).read_bytes()[:-40])  # type: ignore[return-value]


def rescale_mesh(factor: float) -> Callable[[Path], None]:
    def edit(root: Path) -> None:
        path = root / "models/obj_000007.ply"
        mesh = trimesh.load(path, process=False)
        mesh.apply_scale(factor)
        mesh.export(path)

    return edit


def mesh_text(*vertices: str) -> bytes:
    header = f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\n"
    header += "property float x\nproperty float y\nproperty float z\n"
    header += f"element face {min(1, len(vertices))}\nproperty list uchar int vertex_indices\nend_header\n"
    return (header + "\n".join(vertices) + ("\n3 0 1 2\n" if vertices else "")).encode()


MIRROR = [1, 0, 0, 0, 1, 0, 0, 0, -1]
TWICE = [2, 0, 0, 0, 2, 0, 0, 0, 2]
CAMERA_FILE, GT_FILE, INFO_FILE = (
    f"{SCENE}/scene_camera.json",
    f"{SCENE}/scene_gt.json",
    "models/models_info.json",
)
MESH_FILE, DEPTH_FILE, COLOR_FILE = (
    "models/obj_000007.ply",
    f"{SCENE}/depth/000003.png",
    f"{SCENE}/rgb/000003.png",
)

BAD_INPUTS = {
    "depth image missing": (remove(DEPTH_FILE), [DEPTH_FILE, "missing", "image 3"]),
    "depth image truncated": (truncate(DEPTH_FILE), [DEPTH_FILE, "decoded"]),
    "depth image is no image": (replace(DEPTH_FILE, b"not a PNG"), [DEPTH_FILE, "decoded"]),
    "depth image of 8 bits": (save_image(DEPTH_FILE, Image.new("L", (32, 24))), [DEPTH_FILE, "16-bit", "L"]),
    "colour truncated": (truncate(COLOR_FILE), [COLOR_FILE, "decoded"]),
    "sizes differ": (
        save_image(COLOR_FILE, Image.new("RGB", (30, 24))),
        [COLOR_FILE, "30x24", "32x24"],
    ),
    "8 intrinsics": (edit_camera(cam_K=[1.0] * 8), [CAMERA_FILE, "image 3", "cam_K", "9", "8"]),
    "intrinsics with skew": (
        edit_camera(cam_K=[40, 5, 15, 0, 40, 11, 0, 0, 1]),
        [CAMERA_FILE, "image 3", "cam_K", "skew"],
    ),
    "focal length 0": (
        edit_camera(cam_K=[0, 0, 15, 0, 40, 11, 0, 0, 1]),
        [CAMERA_FILE, "cam_K", "fx is 0.0"],
    ),
    "intrinsics of text": (edit_camera(cam_K=["a"] * 9), [CAMERA_FILE, "cam_K", '"a"']),
    "intrinsics NaN": (edit_camera(cam_K=[float("nan")] * 9), [CAMERA_FILE, "cam_K", "NaN"]),
    "intrinsics no list": (edit_camera(cam_K=7), [CAMERA_FILE, "cam_K", "7"]),
    "depth scale 0": (edit_camera(depth_scale=0), [CAMERA_FILE, "image 3", "depth_scale", "above 0", "is 0"]),
    "depth scale text": (edit_camera(depth_scale="1"), [CAMERA_FILE, "depth_scale", '"1"']),
    "depth scale missing": (
        lambda root: change(root, "scene_camera.json", lambda c: c["3"].pop("depth_scale")),
        [CAMERA_FILE, "image 3", "depth_scale", "missing"],
    ),
    "camera rotation scaled": (edit_camera(cam_R_w2c=TWICE), [CAMERA_FILE, "cam_R_w2c", "rotation"]),
    "camera without translation": (
        lambda root: change(root, "scene_camera.json", lambda c: c["3"].pop("cam_t_w2c")),
        [CAMERA_FILE, "cam_t_w2c", "missing"],
    ),
    "camera entry a list": (
        lambda root: change(root, "scene_camera.json", lambda c: c.update({"3": []})),
        [CAMERA_FILE, "image 3", "object", "[]"],
    ),
    "no image": (lambda root: change(root, "scene_camera.json", dict.clear), [CAMERA_FILE, "no image"]),
    "cameras missing": (remove(CAMERA_FILE), [CAMERA_FILE, "missing"]),
    "cameras no JSON": (replace(CAMERA_FILE, b'{"3": '), [CAMERA_FILE, "JSON", "line 1"]),
    "cameras no text": (replace(CAMERA_FILE, b"\xff\xfe\x00"), [CAMERA_FILE, "text"]),
    "cameras too deep": (replace(CAMERA_FILE, b"[" * 200_000), [CAMERA_FILE, "JSON"]),
    "number without end": (replace(CAMERA_FILE, b'{"3": ' + b"9" * 5000 + b"}"), [CAMERA_FILE, "JSON"]),
    "number beyond floats": (edit_camera(depth_scale=10**400), [CAMERA_FILE, "depth_scale", "1000"]),
    "image id without end": (
        lambda root: change(root, "scene_camera.json", lambda c: c.update({"9" * 5000: {}})),
        [CAMERA_FILE, "whole numbers"],
    ),
    "cameras a list": (replace(CAMERA_FILE, b"[1]"), [CAMERA_FILE, "object", "[1]"]),
    "image id no number": (
        lambda root: change(root, "scene_camera.json", lambda c: c.update(x={})),
        [CAMERA_FILE, "whole numbers", "'x'"],
    ),
    "unknown object": (edit_truth(obj_id=99), [GT_FILE, "image 3", "entry 0", "obj_id 99", "obj_000099.ply"]),
    "object id text": (edit_truth(obj_id="7"), [GT_FILE, "obj_id", '"7"']),
    "mirrored pose": (edit_truth(cam_R_m2c=MIRROR), [GT_FILE, "cam_R_m2c", "mirrors"]),
    "pose in metres": (edit_truth(cam_t_m2c=[0, 0, 0.6]), [GT_FILE, "cam_t_m2c", "0.6 mm", "millimetres"]),
    "translation of 2": (edit_truth(cam_t_m2c=[0, 0]), [GT_FILE, "cam_t_m2c", "3 numbers", "2"]),
    "truth of another image": (
        lambda root: change(root, "scene_gt.json", lambda c: c.update({"5": []})),
        [GT_FILE, "image 5", "scene_camera.json"],
    ),
    "truths no list": (
        lambda root: change(root, "scene_gt.json", lambda c: c.update({"3": {}})),
        [GT_FILE, "image 3", "list", "{}"],
    ),
    "mesh in metres": (rescale_mesh(0.001), [MESH_FILE, "0.1414 mm", "millimetres"]),
    "mesh too large": (rescale_mesh(1000.0), [MESH_FILE, "1.414e+05 mm", "millimetres"]),
    "mesh empty": (replace(MESH_FILE, mesh_text()), [MESH_FILE, "empty"]),
    "mesh no mesh": (replace(MESH_FILE, b"hello"), [MESH_FILE, "mesh cannot be read"]),
    "mesh NaN": (replace(MESH_FILE, mesh_text("0 0 0", "nan 0 50", "0 50 0")), [MESH_FILE, "NaN"]),
    "mesh missing": (remove(MESH_FILE), ["models", "obj_000001.ply"]),
    "mesh without number": (
        lambda root: (root / MESH_FILE).rename(root / "models/obj_mug.ply"),
        ["models/obj_mug.ply", "number"],
    ),
    "diameter off": (edit_info(diameter=160.0), [INFO_FILE, "object 7", "diameter", "160 mm", "141.421 mm"]),
    "diameter 0": (edit_info(diameter=0), [INFO_FILE, "object 7", "diameter", "above 0"]),
    "symmetry of 12": (
        edit_info(symmetries_discrete=[[0] * 12]),
        [INFO_FILE, "symmetries_discrete[0]", "16", "12"],
    ),
    "symmetry no rotation": (
        edit_info(symmetries_discrete=[[0] * 16]),
        [INFO_FILE, "symmetries_discrete[0]", "rotation"],
    ),
    "symmetry last row": (
        edit_info(symmetries_discrete=[[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2]]),
        [INFO_FILE, "symmetries_discrete[0]", "0 0 0 1"],
    ),
    "symmetries no list": (edit_info(symmetries_discrete={}), [INFO_FILE, "symmetries_discrete", "{}"]),
    "axis 0": (
        edit_info(symmetries_continuous=[{"axis": [0, 0, 0]}]),
        [INFO_FILE, "symmetries_continuous[0]", "axis", "direction"],
    ),
    "name no text": (
        lambda root: change(root, "names.json", lambda c: c.update({"7": 3})),
        ["models/names.json", "object 7", "text", "3"],
    ),
    "no scene": (
        lambda root: (root / "test").rename(root / "models/test"),
        ["small", "no scene", "test/000001"],
    ),
}


@pytest.mark.parametrize("case", BAD_INPUTS)
def test_bad_input_gives_one_sentence_with_file_field_and_value(dataset, case):
    spoil, fragments = BAD_INPUTS[case]
    spoil(dataset)
    with pytest.raises(BopFormatError) as caught:
        read_dataset(dataset)
    message = str(caught.value)
    assert "\n" not in message
    assert str(dataset) not in message
    for fragment in fragments:
        assert fragment in message


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(BopFormatError, match="nowhere is no folder"):
        read_dataset(tmp_path / "nowhere")


def test_the_real_ycbv_scenes(shared_data):
    read = read_dataset(shared_data / "ycbv")
    assert len(read.objects) == 21
    assert [(scene.scene_id, len(scene.images)) for scene in read.scenes] == [(1, 2), (2, 5)]
    assert read.objects[13].name == "025_mug"
    image = read.scenes[0].images[0]
    assert image.ground_truth is not None
    assert {truth.obj_id for truth in image.ground_truth} == {8, 14, 21}
    assert read.scenes[1].images[0].ground_truth is None
    assert image.T_world_camera is None


def test_official_poses_fit_the_real_depth(shared_data):
    read = read_dataset(shared_data / "ycbv")
    models = {known.obj_id: known.model for known in read.objects}
    image = read.scenes[0].images[0]
    observed = read_depth(image.depth.path, image.depth_scale)
    assert image.ground_truth is not None
    for truth in image.ground_truth:
        rendered = render_depth(models[truth.obj_id], image.camera, truth.T_camera_object)
        shown = (rendered > 0) & (observed > 0) & (np.abs(rendered - observed) < 0.02)
        assert shown.sum() > 0.5 * (rendered > 0).sum()
        assert np.median(np.abs(rendered - observed)[shown]) < 0.004


def world_pose(image: BopImage) -> np.ndarray:
    """`T_world_object` (4, 4) of the first object in an image."""
    assert image.T_world_camera is not None and image.ground_truth is not None
    return image.T_world_camera @ image.ground_truth[0].T_camera_object


def test_the_real_bunny_has_one_world(shared_data):
    # Camera and object poses come from different sources with one common offset: the object stands still.
    images = read_dataset(shared_data / "bunny").scenes[0].images
    assert len(images) == 24
    in_world = [world_pose(image) for image in images]
    corners = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
    assert max(add(T, in_world[0], corners) for T in in_world) < 0.01
