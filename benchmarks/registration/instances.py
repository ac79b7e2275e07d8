"""What is registered: objects in depth images with their true poses."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.registration.objects import APC_BOX, DATA, known_objects, with_symmetries, ycb_object
from benchmarks.registration.starts import is_in_view
from registration_core import Intrinsics, ObjectModel, color_is_aligned
from registration_core.bop.dataset import BopObject, read_color, read_dataset, read_depth
from registration_core.geometry import pose
from registration_core.synthetic.mesh_error import imprecise
from registration_core.synthetic.scene import View, make_scene
from registration_core.synthetic.sensor_families import DEMO, FAMILIES, draw_sensor, measure
from registration_core.synthetic.tabletop import Layout

Array = NDArray[np.float64]

HALF, HIDDEN = "at least half visible", "30-50 % visible"
YCB, BUNNY, MORO, APC, RBT = "ycbv/000001", "bunny", "moro", "apc", "rbt"
INEXACT = "meshes off by 1 %"
SENSORS = tuple(f"sensor: {name}" for name in FAMILIES if name != DEMO.name)
"""The scenes of HALF as other families of sensors measure them."""
PLAIN = (HALF, HIDDEN)
"""With the demo scenes' sensor and exact meshes."""
SYNTHETIC, REAL = (*PLAIN, *SENSORS, INEXACT), (YCB, BUNNY, MORO, APC, RBT)
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
FOLDERS = {YCB: "ycbv", BUNNY: "bunny", MORO: "moro", APC: "apc", RBT: "rbt"}
"""Of the datasets, in `DATA`; scene 1 of each is annotated."""
FRAME_STEPS = {BUNNY: 3, RBT: 4}
"""Of the bunny every third of 24 views, 45 degrees apart; of the video every fourth of 50 frames."""


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
    alike: tuple[Array, ...] = ()
    """`T_camera_object` of what else in the image has this very shape: to depth they are one object."""

    @cached_property
    def aligned_color(self) -> NDArray[np.uint8] | None:
        """(H, W, 3), the colour image where it is seen to be aligned with the depth."""
        if self.color_path is None:
            return None
        color = read_color(self.color_path)
        return color if color_is_aligned(color, self.depth) else None

    @property
    def truths(self) -> tuple[Array, ...]:
        """Every pose (4, 4) that is right."""
        return (self.truth, *self.alike)


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


def sensor_instances(set_name: str, an_object: int, most_scenes: int = MOST_SCENES) -> list[Instance]:
    """The instances of HALF, each measured by a sensor that is drawn from the family of the set."""
    family = FAMILIES[set_name.removeprefix("sensor: ")]
    found = []
    for number, one in enumerate(_half_visible(an_object, most_scenes)):
        assert one.perfect_depth is not None
        rng = np.random.default_rng([SENSORS.index(set_name), number])
        depth = measure(one.perfect_depth, one.camera, rng, draw_sensor(family, rng))
        found.append(replace(one, set_name=set_name, depth=depth))
    return found


def inexact_instances(an_object: int, most_scenes: int = MOST_SCENES) -> list[Instance]:
    """The instances of HALF, each with a mesh that is a little wrong."""
    return [
        replace(one, set_name=INEXACT, model=imprecise(one.model, np.random.default_rng(number)))
        for number, one in enumerate(_half_visible(an_object, most_scenes))
    ]


@cache
def _half_visible(an_object: int, most_scenes: int) -> tuple[Instance, ...]:
    """The instances of HALF, made once for all sets that change something about them."""
    return tuple(synthetic_instances(HALF, an_object, most_scenes))


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
    return list(_annotated(set_name))


def _annotated(set_name: str) -> Iterator[Instance]:
    dataset = read_dataset(DATA / FOLDERS[set_name])
    images = next(scene for scene in dataset.scenes if scene.scene_id == 1).images
    models = {known.obj_id: _model(set_name, known) for known in dataset.objects}
    names = {known.obj_id: _name(set_name, known) for known in dataset.objects}
    for image in images[:: FRAME_STEPS.get(set_name, 1)]:
        depth = read_depth(image.depth.path, image.depth_scale)
        truths = image.ground_truth or ()
        for index, truth in enumerate(truths):
            model, name = models[truth.obj_id], names[truth.obj_id]
            alike = tuple(
                other.T_camera_object
                for other in truths
                if other is not truth and models[other.obj_id].content_hash == model.content_hash
            )
            # the neighbouring frames of YCB-Video differ by object, the others by view
            scene = name if set_name == YCB else str(image.image_id)
            yield Instance(
                set_name, f"{set_name} {scene}", name, model, depth, image.camera, truth.T_camera_object,
                image.image_id * len(truths) + index, color_path=image.color.path if image.color else None,
                T_world_camera=image.T_world_camera, alike=alike,
            )  # fmt: skip


def _model(set_name: str, known: BopObject) -> ObjectModel:
    if set_name == YCB:
        return ycb_object(known.obj_id)
    return with_symmetries(known.model, APC_BOX) if set_name == APC else known.model


def _name(set_name: str, known: BopObject) -> str:
    return known.name if set_name == YCB else f"{set_name} {known.obj_id}"
