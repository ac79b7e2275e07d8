from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from registration_core.bop.dataset import BopGroundTruth, BopImage, read_color, read_dataset, read_depth
from registration_core.geometry import pose
from registration_core.geometry.camera import Intrinsics
from registration_core.geometry.object_model import ObjectModel
from registration_core.rendering.opengl import Renderer
from registration_core.rendering.rasterizer import render_depth
from registration_core.synthetic.dataset import (
    LEAST_VISIBLE,
    LEAST_VISIBLE_ONCE,
    main,
    make_demo_dataset,
    make_scene,
)
from registration_core.synthetic.objects import demo_objects
from registration_core.synthetic.scene import CAMERA, Silhouette, table_model
from registration_core.synthetic.tabletop import Layout, Placed

pytestmark = pytest.mark.slow  # renders whole scenes

REPOSITORY = Path(__file__).resolve().parents[3]
MODELS = [known.model for known in demo_objects()]


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("demo")
    make_demo_dataset(out, seed=3, scenes=1)
    return out


def files_of(root: Path) -> dict[str, bytes]:
    return {
        path.relative_to(root).as_posix(): path.read_bytes() for path in root.rglob("*") if path.is_file()
    }


def test_the_written_dataset_is_a_bop_dataset(written):
    dataset = read_dataset(written)
    assert [known.name for known in dataset.objects] == ["drill", "mug", "bottle", "bowl", "box"]
    for known, source in zip(dataset.objects, demo_objects(), strict=True):
        assert known.model.vertices == pytest.approx(source.model.vertices, abs=1e-6)
        assert len(known.model.symmetry_transforms) == len(source.model.symmetry_transforms)
    (scene,) = dataset.scenes
    assert len(scene.images) == 3
    assert all(image.color is not None and len(truths(image)) == 5 for image in scene.images)


def truths(image: BopImage) -> tuple[BopGroundTruth, ...]:
    assert image.ground_truth is not None
    return image.ground_truth


def world_pose(image: BopImage, index: int) -> np.ndarray:
    """`T_world_object` (4, 4) of one object in an image."""
    assert image.T_world_camera is not None
    return image.T_world_camera @ truths(image)[index].T_camera_object


def test_true_poses_agree_between_views_and_with_depth(written):
    dataset = read_dataset(written)
    images = dataset.scenes[0].images
    for index, known in enumerate(dataset.objects):
        in_world = [world_pose(image, index) for image in images]
        assert in_world[1] == pytest.approx(in_world[0], abs=1e-9)
        assert in_world[2] == pytest.approx(in_world[0], abs=1e-9)
        errors = []
        for image in images:
            depth = read_depth(image.depth.path, image.depth_scale)
            rendered = render_depth(known.model, image.camera, truths(image)[index].T_camera_object)
            seen = (rendered > 0) & (depth > 0) & (rendered < depth + 0.02)
            errors.append((depth - rendered)[seen])
        assert np.median(np.abs(np.concatenate(errors))) < 0.002


def test_pictures_show_the_objects_where_they_are(written):
    dataset = read_dataset(written)
    for image in dataset.scenes[0].images:
        assert image.color is not None
        picture = read_color(image.color.path).astype(int)
        T_camera_bowl = truths(image)[3].T_camera_object
        blue = (picture[..., 2] > picture[..., 0] + 40) & (picture[..., 2] > picture[..., 1] + 30)
        silhouette = render_depth(dataset.objects[3].model, image.camera, T_camera_bowl) > 0
        if (blue & silhouette).sum() > 100:
            return
    pytest.fail("the blue bowl is in no picture where it should be")


def test_the_same_seed_gives_the_same_bytes(written, tmp_path):
    make_demo_dataset(tmp_path, seed=3, scenes=1)
    assert files_of(tmp_path) == files_of(written)


def test_the_bundled_scenes_are_what_the_command_makes():
    bundled = REPOSITORY / "scenes" / "demo"
    sizes = [len(content) for content in files_of(bundled).values()]
    assert sum(sizes) < 8_000_000
    dataset = read_dataset(bundled)
    assert [len(scene.images) for scene in dataset.scenes] == [3, 3, 3, 3]
    assert all(image.camera == CAMERA for scene in dataset.scenes for image in scene.images)


def test_every_bundled_object_shows_well_in_some_view():
    dataset = read_dataset(REPOSITORY / "scenes" / "demo")
    for scene in dataset.scenes:
        shares = np.array([visible_shares(dataset.objects, image) for image in scene.images])
        assert shares.max(axis=0).min() >= LEAST_VISIBLE_ONCE - 0.05
        assert shares.min() >= LEAST_VISIBLE - 0.05


def visible_shares(objects, image) -> list[float]:
    """Visible share of each object by the measured depth, counted as an exported dataset counts it."""
    depth = read_depth(image.depth.path, image.depth_scale)
    depth[depth == 0] = np.inf
    shares = []
    for known, truth in zip(objects, image.ground_truth, strict=True):
        placed = Placed(known.model, image.T_world_camera @ truth.T_camera_object)
        silhouette = Silhouette.of(placed, image.camera, pose.inverse(image.T_world_camera))
        shares.append(silhouette.visible_share(depth + 0.015))
    return shares


def test_the_command_line_names_what_it_wrote(tmp_path, monkeypatch, capsys):
    calls = []
    monkeypatch.setattr(
        "registration_core.synthetic.dataset.make_demo_dataset", lambda *given: calls.append(given)
    )
    monkeypatch.setattr("sys.argv", ["synthetic", str(tmp_path), "--seed", "4"])
    main()
    assert calls == [(tmp_path, 4)]
    assert str(tmp_path) in capsys.readouterr().out


@pytest.mark.parametrize("seed", range(3))
def test_perfect_depth_is_what_opengl_draws_of_the_same_scene(seed):
    scene = make_scene(np.random.default_rng(seed), MODELS)
    view = scene.views[0]
    T_camera_world = pose.inverse(view.T_world_camera)
    placed = [(table_model(), T_camera_world)]
    placed += [(thing.model, T_camera_world @ thing.T_world_object) for thing in scene.objects]
    placed += [(thing.model, T_camera_world @ T) for thing, T in scene.distractors]
    with Renderer(view.camera) as renderer:
        drawn = renderer.depth(placed)
    assert (np.abs(drawn - view.perfect_depth) > 1e-4).sum() < 20


def test_scenes_come_again_with_the_seed():
    first, again = (make_scene(np.random.default_rng(8), MODELS, views=2) for _ in range(2))
    for a, b in zip(first.views, again.views, strict=True):
        assert np.array_equal(a.depth, b.depth)
        assert [i.visible for i in a.instances] == [i.visible for i in b.instances]


def test_instances_are_the_objects_in_their_order():
    scene = make_scene(np.random.default_rng(1), MODELS, views=2)
    assert [thing.model for thing in scene.objects] == MODELS
    for view in scene.views:
        for thing, instance in zip(scene.objects, view.instances, strict=True):
            assert view.T_world_camera @ instance.T_camera_object == pytest.approx(thing.T_world_object)


def test_one_object_alone_is_wholly_visible():
    scene = make_scene(np.random.default_rng(2), MODELS[:1], distractors=0)
    assert scene.views[0].instances[0].visible == 1.0


def test_lower_cameras_see_more_occlusion():
    means = []
    for elevation in ((0.9, 1.2), (0.15, 0.3)):
        views = [
            make_scene(np.random.default_rng(k), MODELS, layout=Layout(elevation=elevation)).views[0]
            for k in range(3)
        ]
        means.append(np.mean([instance.visible for view in views for instance in view.instances]))
    assert means[1] < means[0] - 0.1


def silhouette_at(x: float, z: float = 1.0) -> tuple[Silhouette, np.ndarray]:
    """A square plate of 20 x 20 pixels centred on column 32 + 100 x of an image of 64 x 48."""
    camera = Intrinsics(width=64, height=48, fx=100.0, fy=100.0, cx=31.5, cy=23.5)
    corners = np.array([[a, b, 0.0] for a in (-0.1, 0.1) for b in (-0.1, 0.1)])
    plate = ObjectModel(corners, np.array([[0, 1, 2], [2, 1, 3]], dtype=np.int32))
    placed = Placed(plate, pose.from_rotation_translation(np.eye(3), [x, 0.0, z]))
    return Silhouette.of(placed, camera, np.eye(4)), np.full((48, 64), np.inf, dtype=np.float32)


def test_a_silhouette_counts_what_lies_outside_of_the_image():
    silhouette, nearest = silhouette_at(0.315)  # its middle lies on the last column's centre
    silhouette.draw_into(nearest)
    assert np.isfinite(nearest).sum() == pytest.approx(11 * 20, abs=20)
    assert silhouette.visible_share(nearest) == pytest.approx(0.5, abs=0.05)


def test_a_silhouette_beyond_the_image_is_invisible():
    silhouette, nearest = silhouette_at(2.0)
    silhouette.draw_into(nearest)
    assert not np.isfinite(nearest).any()
    assert silhouette.visible_share(nearest) == 0.0


def test_what_is_hidden_does_not_count_as_visible():
    silhouette, nearest = silhouette_at(0.0)
    silhouette.draw_into(nearest)
    nearest[:, :32] = 0.5
    assert silhouette.visible_share(nearest) == pytest.approx(0.5, abs=0.03)


def test_pictures_of_the_bundle_are_of_the_cameras_size():
    for path in (REPOSITORY / "scenes" / "demo").rglob("rgb/*.png"):
        with Image.open(path) as image:
            assert image.size == (640, 480)
