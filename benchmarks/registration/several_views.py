"""One pose against several views: the turning bunny, and a mug whose handle is hidden in one of two views."""

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.figures import Figure, Target
from benchmarks.registration.ambiguity import fits_as_well
from benchmarks.registration.instances import BUNNY, Instance, real_instances
from benchmarks.registration.judging import Judge
from benchmarks.registration.starts import FARTHEST, MIDDLE, Shell, starts
from registration_core import snap_views
from registration_core.geometry import pose
from registration_core.synthetic.objects import demo_objects
from registration_core.synthetic.scene import make_scene
from registration_core.synthetic.sensor_families import FAMILIES, SensorFamily
from registration_core.synthetic.tabletop import Layout

Array = NDArray[np.float64]

OF_THE_BUNNY, OF_THE_MUG = Target(100.0, at_least=True), Target(97.0, at_least=True)
VIEWS = 4
"""90 degrees apart on the turntable."""
STARTS, MUGS = 20, 24
"""Of each group of views of the bunny; scenes with a mug."""
STARTS_OF_A_MUG = 4
"""In each scene."""

MUG = next(known for known in demo_objects() if known.name == "mug")
MUG_RADIUS = 0.0425
"""Of its body, metres."""
MUG_LAYOUT = Layout(upright=1.0, elevation=(0.35, 0.6))
"""Cameras so low that the body can hide the handle."""
MUG_SEED, AROUND_THE_MUG, MUG_DISTRACTORS = 3, 8, 2
"""Cameras, and other things on the table."""
MUG_VISIBLE = 0.7
"""Least share of it that shows in a view; the handle is less than the rest."""
TURNS = np.radians([-60.0, -30.0, 30.0, 60.0])
"""Of the mug about its body."""
MOST_SCENES = 200
"""Looked at for such views."""


@dataclass(frozen=True, eq=False)
class Group:
    """Views of one object, the first one being what its starts are about."""

    views: Sequence[Instance]
    shell: Shell
    starts: int


def view_figures(pool: Executor, quick: bool) -> list[Figure]:
    """The share of starts from which the MSSD ends below 5 %; the bunny only with the data."""
    bunnies, mugs = bunny_groups(1 if quick else STARTS), mug_groups(1 if quick else MUGS, STARTS_OF_A_MUG)
    figures = []
    for name, groups, target in (
        (f"{BUNNY}, {VIEWS} views", bunnies, OF_THE_BUNNY),
        ("mug, its handle hidden in one view and seen in another", mugs, OF_THE_MUG),
    ):
        exact = [flag for flags in pool.map(_exact, groups) for flag in flags]
        if exact:
            share = 100.0 * float(np.mean(exact))
            figures.append(Figure(f"{name}, MSSD < 5 %, from {groups[0].shell}", share, "%", target))
    return figures


def bunny_groups(starts_a_group: int) -> list[Group]:
    """All groups of views that are 90 degrees apart; none without the data."""
    instances = real_instances(BUNNY)
    apart = len(instances) // VIEWS
    return [Group(instances[first::apart], FARTHEST, starts_a_group) for first in range(apart)]


def mug_groups(count: int, starts_a_group: int) -> list[Group]:
    """Two views of a mug, of which only the second one's depth tells where the handle is; one sensor after
    the other.
    """
    groups: list[Group] = []
    for scene in range(MOST_SCENES):
        if len(groups) == count:
            break
        family = list(FAMILIES.values())[len(groups) % len(FAMILIES)]
        views = _mug_views(scene, family)
        told = [tells_the_handle(view) for view in views]
        if not all(told) and any(told):
            groups.append(Group([views[told.index(False)], views[told.index(True)]], MIDDLE, starts_a_group))
    return groups


def _mug_views(scene_id: int, family: SensorFamily) -> list[Instance]:
    """Those in which most of the mug shows."""
    rng = np.random.default_rng([MUG_SEED, scene_id])
    scene = make_scene(rng, [MUG.model], MUG_DISTRACTORS, AROUND_THE_MUG, layout=MUG_LAYOUT, family=family)
    return [
        Instance(
            MUG.name, f"{MUG.name} {scene_id}", MUG.name, MUG.model, view.depth, view.camera,
            view.instances[0].T_camera_object, scene_id, view.perfect_depth,
            T_world_camera=view.T_world_camera,
        )
        for view in scene.views
        if view.instances[0].visible > MUG_VISIBLE
    ]  # fmt: skip


def camera_pose(view: Instance) -> Array:
    """`T_world_camera` (4, 4) of a view of a group: the views of one are in a common world."""
    assert view.T_world_camera is not None
    return view.T_world_camera


def tells_the_handle(view: Instance) -> bool:
    """Whether depth contradicts every turn of the mug about its body."""
    return not any(fits_as_well(view, view.truth @ turned_mug(angle)) for angle in TURNS)


def turned_mug(angle: float) -> Array:
    """The mug (4, 4) turned about the axis of its body, which is not that of its bounding box."""
    axis = MUG.model.vertices[:, 0].min() + MUG_RADIUS
    T_axis = pose.exp([axis, 0.0, 0.0, 0.0, 0.0, 0.0])
    return T_axis @ pose.exp([0.0, 0.0, 0.0, 0.0, 0.0, angle]) @ pose.inverse(T_axis)


def _exact(group: Group) -> list[bool]:
    """Of starts about the object as its first view shows it."""
    first = group.views[0]
    judge = Judge(first.model)
    views = [(one.depth, one.camera, camera_pose(one)) for one in group.views]
    colors = [one.aligned_color for one in group.views]
    truth = pose.mean(np.array([camera_pose(one) @ one.truth for one in group.views]))
    begun = starts(first.truth, first.model, first.camera, group.shell, group.starts, first.seed)
    flags = []
    for n, T_start in enumerate(begun):
        T_world_object = pose.orthonormalised(camera_pose(first) @ T_start)
        estimate = snap_views(first.model, views, T_world_object, rng=np.random.default_rng(n), colors=colors)
        flags.append(judge.error(estimate.T_world_object, truth).is_exact)
    return flags
