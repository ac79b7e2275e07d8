"""What is registered: objects in depth images with their true poses."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.registration.objects import DATA, known_objects, read_model, ycb_object
from benchmarks.registration.starts import is_in_view
from registration_core import Intrinsics, ObjectModel, pose
from registration_core.bop import read_dataset, read_depth
from registration_core.synthetic_scene import View, make_scene
from registration_core.tabletop import Layout

Array = NDArray[np.float64]

HALF, HIDDEN, YCB, BUNNY = "at least half visible", "30-50 % visible", "ycbv/000001", "bunny"
SYNTHETIC, REAL = (HALF, HIDDEN), (YCB, BUNNY)
SETS = SYNTHETIC + REAL


@dataclass(frozen=True)
class Recipe:
    """How synthetic scenes of one set come about."""

    visible: tuple[float, float]
    """Least and largest share of the silhouette that shows."""
    distractors: int
    layout: Layout
    seed: int


RECIPES = {
    HALF: Recipe((0.5, 1.01), 4, Layout(), 1),
    HIDDEN: Recipe((0.3, 0.5), 6, Layout(radius=0.08, elevation=(0.2, 0.5)), 2),
}
"""Lower cameras and more things on the table hide more."""

OBJECTS_A_SCENE, VIEWS_A_SCENE = 5, 3
MOST_SCENES = 60
"""After which an object that has not shown as it should often enough is left at what there is."""
BUNNY_STEP = 3
"""Every third of its 24 views, 45 degrees apart."""


@dataclass(frozen=True, eq=False)
class Instance:
    """One object in one image."""

    set_name: str
    scene: str
    """Instances of one scene share what is hard in it."""
    object_name: str
    model: ObjectModel
    depth: NDArray[np.float32]
    """(H, W), metres, 0 = no measurement."""
    camera: Intrinsics
    truth: Array
    """`T_camera_object` (4, 4)."""
    seed: int
    """Of its starts."""
    perfect_depth: NDArray[np.float32] | None = None
    """The same without a sensor's errors, where it is known."""
    color_path: Path | None = None
    T_world_camera: Array | None = None
    """(4, 4), where it is known."""


def synthetic_instances(set_name: str, an_object: int, most_scenes: int = MOST_SCENES) -> list[Instance]:
    """So many instances of each known object among others and unknown things; always the same ones."""
    recipe, objects = RECIPES[set_name], known_objects()
    found: Counter[str] = Counter()
    instances: list[Instance] = []
    for scene_id in range(most_scenes):
        if all(found[name] == an_object for name in objects):
            break
        rng = np.random.default_rng([recipe.seed, scene_id])
        rarest = sorted(rng.permutation(list(objects)).tolist(), key=lambda name: found[name])
        shown = rarest[:OBJECTS_A_SCENE]
        scene = make_scene(
            rng, [objects[name] for name in shown], recipe.distractors, VIEWS_A_SCENE, layout=recipe.layout
        )
        for index, name in enumerate(shown):
            views = [view for view in scene.views if _shows(view, index, objects[name], recipe)]
            if found[name] < an_object and views:
                found[name] += 1
                instances.append(
                    Instance(
                        set_name, f"{set_name} {scene_id}", name, objects[name], views[0].depth,
                        views[0].camera, views[0].instances[index].T_camera_object, len(instances),
                        views[0].perfect_depth,
                    )
                )  # fmt: skip
    return instances


def _shows(view: View, index: int, model: ObjectModel, recipe: Recipe) -> bool:
    """Whether as much of an object is visible as wanted, its middle not cut off by the image's border."""
    seen = view.instances[index]
    least, most = recipe.visible
    centre = pose.apply(seen.T_camera_object, model.centre)
    return least <= seen.visible < most and is_in_view(centre, view.camera)


def real_instances(set_name: str) -> list[Instance]:
    """The annotated objects of a real scene; none where the data is not there."""
    if not DATA.is_dir():
        return []
    return list(_ycb() if set_name == YCB else _bunny())


def _ycb() -> Iterator[Instance]:
    dataset = read_dataset(DATA / "ycbv")
    images = next(scene for scene in dataset.scenes if scene.scene_id == 1).images
    names = {known.obj_id: known.name for known in dataset.objects}
    seed = 0
    for image in images:
        depth = read_depth(image.depth_path, image.depth_scale)
        for truth in image.ground_truth or ():
            yield Instance(
                YCB, f"{YCB} {names[truth.obj_id]}", names[truth.obj_id], ycb_object(truth.obj_id), depth,
                image.camera, truth.T_camera_object, seed, color_path=image.color_path,
            )  # fmt: skip
            seed += 1


def _bunny() -> Iterator[Instance]:
    (scene,) = read_dataset(DATA / "bunny").scenes
    model = read_model(DATA / "bunny", 1)
    for image in scene.images[::BUNNY_STEP]:
        (truth,) = image.ground_truth or ()
        yield Instance(
            BUNNY, f"{BUNNY} {image.image_id}", BUNNY, model, read_depth(image.depth_path, image.depth_scale),
            image.camera, truth.T_camera_object, image.image_id, color_path=image.color_path,
            T_world_camera=image.T_world_camera,
        )  # fmt: skip
