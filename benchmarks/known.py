"""What it is worth to a snap to know the other objects of the scene."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.figures import Figure
from benchmarks.registration.instances import HALF, HIDDEN, RECIPES
from benchmarks.registration.judging import Judge
from benchmarks.registration.objects import known_objects
from benchmarks.registration.starts import SHELLS, Shell, is_in_view, starts
from registration_core import Intrinsics, ObjectModel, explained_pixels, snap, warm_up
from registration_core.geometry import pose
from registration_core.synthetic.scene import make_scene

Array = NDArray[np.float64]

TITLE = "Snaps that know the other objects of the scene: MSSD < 5 % of the diameter"

DIFFERENT, TWINS = "five different objects", "two pairs of the same among five"
SCENES, QUICK_SCENES, STARTS = 40, 1, 2
"""Of each kind; starts from each shell about each instance."""
DISTRACTORS = 2
VISIBLE = 0.3
"""Least share of an object's silhouette that shows."""
KNOWN_TO = (0.002, np.radians(1.0))
"""By how much the poses of the known objects are off, metres and radians."""


@dataclass(frozen=True, eq=False)
class Sought:
    """An object of a scene, and what the others explain of the image."""

    model: ObjectModel
    depth: NDArray[np.float32]
    camera: Intrinsics
    truth: Array
    explained: NDArray[np.bool_]
    seed: int


def run(folder: Path, quick: bool) -> list[Figure]:
    """Successes without and with knowledge of the others, from the same starts."""
    warm_up()
    figures = []
    for kind in (DIFFERENT, TWINS):
        found: dict[Shell, list[tuple[bool, bool]]] = defaultdict(list)
        for sought in _sought(kind, QUICK_SCENES if quick else SCENES):
            for shell in SHELLS:
                found[shell] += _outcomes(sought, shell)
        for shell, outcomes in found.items():
            alone, knowing = 100.0 * np.mean(outcomes, axis=0)
            figures.append(Figure(f"{kind}, {shell}: alone", float(alone), "%"))
            figures.append(Figure(f"{kind}, {shell}: others known", float(knowing), "%"))
    return figures


def _sought(kind: str, scenes: int) -> Iterator[Sought]:
    objects = known_objects()
    for scene_id in range(scenes):
        rng = np.random.default_rng([3, scene_id])
        names = rng.permutation(list(objects))[:5].tolist()
        if kind == TWINS:
            names = [*names[:3], *names[:2]]
        models = [objects[name] for name in names]
        layout = RECIPES[HIDDEN if scene_id % 2 else HALF].layout
        (view,) = make_scene(rng, models, DISTRACTORS, layout=layout).views
        truths = [instance.T_camera_object for instance in view.instances]
        known = [(model, pose.perturbed(T, *KNOWN_TO, rng)) for model, T in zip(models, truths, strict=True)]
        for index, (model, truth) in enumerate(zip(models, truths, strict=True)):
            centre = pose.apply(truth, model.centre)
            if view.instances[index].visible >= VISIBLE and is_in_view(centre, view.camera):
                others = known[:index] + known[index + 1 :]
                explained = explained_pixels(view.depth, view.camera, others)
                yield Sought(model, view.depth, view.camera, truth, explained, 10 * scene_id + index)


def _outcomes(sought: Sought, shell: Shell) -> Iterator[tuple[bool, bool]]:
    """Whether the snap is right alone, and where it knows the others, for each start."""
    judge = Judge(sought.model)
    poses = starts(sought.truth, sought.model, sought.camera, shell, STARTS, sought.seed)
    for number, T_start in enumerate(poses):
        alone, knowing = (
            snap(
                sought.model, sought.depth, sought.camera, T_start, None, np.random.default_rng(number),
                explained=mask,
            )
            for mask in (None, sought.explained)
        )  # fmt: skip
        yield (
            judge.error(alone.T_camera_object, sought.truth).is_exact,
            judge.error(knowing.T_camera_object, sought.truth).is_exact,
        )
