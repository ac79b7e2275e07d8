"""Seconds and actions until an object is aligned, by every technique, with a scripted operator."""

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from app.resources import DEMO_SCENES
from benchmarks.aligning import TECHNIQUES, Alignment
from benchmarks.figures import Figure, Target
from benchmarks.operators import Operator, signed_in_operators
from benchmarks.registration.objects import DATA, ycb_object
from benchmarks.scenes import KnownTask, known_tasks
from benchmarks.server import RunningServer, server_on
from registration_core.geometry import pose

TITLE = "Aligning an object within 5 mm and 5°, from 20 cm and 45° off: a scripted operator"

START_TRANSLATION, START_ROTATION = 0.20, np.radians(45.0)
"""Metres and radians from the truth."""
SHARE_OF_GIZMO = 0.2
"""Of the gizmo's actions, that live snap and click-to-place with a snap may take."""
FIND_IT_ACTIONS = 3.0
BASELINE, FEW, FIND_IT = "gizmo", ("live snap", "click-to-place and snap"), "find it"


@dataclass(frozen=True)
class Aligned:
    """How one object was aligned."""

    technique: str
    actions: int
    seconds: float
    is_aligned: bool


def run(folder: Path, quick: bool) -> list[Figure]:
    """Every object of the first demo scene, and of the real frames where they are there."""
    datasets = [DEMO_SCENES, *([DATA / "ycbv"] if DATA.is_dir() and not quick else [])]
    with server_on(folder, datasets) as server:
        return measure(server, quick)


def measure(server: RunningServer, quick: bool) -> list[Figure]:
    """Each object by each technique, from the same start."""
    return _figures(asyncio.run(_measure(server, 1 if quick else None)))


async def _measure(server: RunningServer, most: int | None) -> list[Aligned]:
    known = known_tasks(server.state_dir)
    first = known[0].frame.scene_id
    tasks = [task for task in known if task.frame.scene_id == first or task.dataset != known[0].dataset]
    results = []
    async with signed_in_operators(server, len(TECHNIQUES)) as operators:
        for task in tasks[:most]:
            for number, operator in enumerate(operators):
                results.append(await _align(operator, task, list(TECHNIQUES)[number]))
    return results


async def _align(operator: Operator, task: KnownTask, technique: str) -> Aligned:
    rng = np.random.default_rng(task.id)
    model = ycb_object(task.obj_id) if task.dataset == "ycbv" else task.model
    T_object_centre = pose.from_rotation_translation(np.eye(3), model.centre)
    centre = pose.perturbed(task.T_world_object @ T_object_centre, START_TRANSLATION, START_ROTATION, rng)
    start = centre @ pose.inverse(T_object_centre)
    registration_id = await operator.start(task.id)
    await operator.set_pose(registration_id, start)
    async with operator.stream(registration_id) as stream, operator.view(registration_id) as view:
        await stream.until_at(start)
        work = Alignment(operator, registration_id, stream, view, task, model, rng)
        await TECHNIQUES[technique](work)
        return Aligned(technique, work.actions, work.seconds, work.is_aligned(await work.pose()))


def _figures(results: Sequence[Aligned]) -> list[Figure]:
    gizmo = _mean([one.actions for one in results if one.technique == BASELINE])
    figures = []
    for technique in TECHNIQUES:
        own = [one for one in results if one.technique == technique]
        target = None
        if technique in FEW:
            target = Target(SHARE_OF_GIZMO * gizmo)
        elif technique == FIND_IT:
            target = Target(FIND_IT_ACTIONS)
        count = len(own)
        figures += [
            Figure(f"{technique}, mean of {count}", _mean([one.actions for one in own]), "actions", target),
            Figure(f"{technique}: time", _mean([one.seconds for one in own]), "s"),
            Figure(f"{technique}: aligned", 100.0 * _mean([one.is_aligned for one in own]), "%"),
        ]
    return figures


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values))
