"""Searches in synthetic scenes, with the truth of every candidate: what all fitted numbers are fitted to."""

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from multiprocessing import get_context

import numpy as np
from numpy.typing import NDArray

from registration_core.config import SnapConfig
from registration_core.fitting.colors import colored
from registration_core.fitting.objects import KINDS, random_object
from registration_core.fitting.scenes import SETTINGS, Picture, Seen, picture
from registration_core.geometry import pose
from registration_core.geometry.camera import project
from registration_core.geometry.kernels import Array32, centred, from_rows, to_rows
from registration_core.geometry.object_model import ObjectModel, Symmetries
from registration_core.judge.confidence import EXACT
from registration_core.search.snap_input import checked_problem
from registration_core.search.sparse_score import heavy_tails
from registration_core.snap_run import NEAR_ITERATIONS, NEAR_TUKEY, Sighting, SnapRun
from registration_core.synthetic.mesh_error import imprecise
from registration_core.synthetic.sensor_families import FAMILIES, draw_sensor, measure
from registration_core.view_search import search_of

Array = NDArray[np.float64]

SHELLS = ((0.003, 3.0), (0.02, 15.0), (0.05, 30.0), (0.10, 60.0), (0.15, 90.0))
"""How far off starts are, metres and degrees, ..."""
SHARES = (0.15, 0.2, 0.25, 0.25, 0.15)
"""... and how many of them."""
RANGES = {"active stereo": 0.85, "line pattern": 0.75}
"""Metres up to which sensors are used that lose their sight early."""
STARTS = 2
"""About each instance."""
VARIANTS = 3
"""Objects of each kind."""
LEAST_VISIBLE = 0.3
"""Share of the silhouette that must show."""
BORDER = 20
"""Pixels from the image's border within which no object's middle lies."""
COLORED = 0.75
"""Share of scenes that come with a colour image."""
IMPRECISE, UNDECLARED = 0.75, 0.5
"""Share of objects whose mesh is a little wrong, and of those whose symmetries nobody has told."""
RIGHT = 0.10
"""Mean distance of surface points, share of the diameter, up to which a pose is right; it is exact where the
largest is below what the confidence is about."""
TRUTH_TUKEY = (0.012, 0.004)
"""Widths of the robust kernel by which the truth is looked up in the measured depth, metres."""
POINTS = 120
"""Surface points by which poses are judged."""
SYMMETRY_STEP = 0.05
"""Of continuous symmetries, share of the diameter."""


@dataclass(frozen=True, eq=False)
class Trial:
    """One search with all its rounds, however sure; N candidates, the start first, then its polishes."""

    kind: str
    variant: int
    """Of the objects of this kind."""
    family: str
    shell: int
    """Of SHELLS."""
    near: int
    """Polishes of the start."""
    ends: tuple[int, ...]
    """Candidates there are before the first round, and after each."""
    poses: Array32
    """(N, 3, 4)."""
    counts: Array
    """(N, evidence.COUNT)."""
    tails: Array
    """(N,), how far from the start, as `heavy_tails` gives it."""
    right: NDArray[np.bool_]
    """(N,), whether the mean distance is below RIGHT."""
    exact: NDArray[np.bool_]
    """(N,), whether the largest distance is below EXACT."""
    spreads: Array
    """(N,), of the surface, as `surface_spreads` gives them."""


def all_trials(seed: int, scenes: int) -> list[Trial]:
    """Trials of so many scenes, spread over the processors; the same for the same seed."""
    threads = ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS")
    os.environ.update(dict.fromkeys(threads, "1"))  # read by the processes that are started now
    with ProcessPoolExecutor(len(os.sched_getaffinity(0)), get_context("spawn")) as pool:
        found = pool.map(scene_trials, [seed] * scenes, range(scenes), chunksize=2)
        return [trial for trials in found for trial in trials]


def scene_trials(seed: int, scene: int) -> list[Trial]:
    """The trials of one scene: families and settings take turns."""
    rng = np.random.default_rng([seed, scene])
    families, settings = list(FAMILIES), list(SETTINGS)
    family, setting = families[scene % len(families)], settings[(scene // len(families)) % len(settings)]
    kinds = rng.permutation(sorted(KINDS))[: SETTINGS[setting].objects]
    variants = rng.integers(VARIANTS, size=len(kinds)).tolist()
    objects = [true_model(str(kind), variant) for kind, variant in zip(kinds, variants, strict=True)]
    view = picture(setting, objects, rng, RANGES.get(family, np.inf))
    depth = measure(view.depth, view.camera, rng, draw_sensor(FAMILIES[family], rng))
    if view.kept is not None:
        depth = np.where(view.kept, depth, np.float32(0.0))
    color = colored(view, rng) if rng.random() < COLORED else None
    trials: list[Trial] = []
    for seen in view.seen:
        if seen.visible < LEAST_VISIBLE or not _is_well_within(view, seen, objects[seen.index]):
            continue
        kind, variant = str(kinds[seen.index]), variants[seen.index]
        told = told_model(kind, variant)
        for shell in rng.choice(len(SHELLS), STARTS, replace=False, p=SHARES):
            start = start_on(int(shell), seen.T_camera_object, told, rng)
            run = started_run(told, depth, color, view, start, int(rng.integers(2**31)))
            if run is not None:
                trials.append(_trial(run, kind, variant, family, int(shell), view, seen))
    return trials


@cache
def true_model(kind: str, variant: int) -> ObjectModel:
    """An object as it is in the scenes."""
    return random_object(kind, variant).model


@cache
def told_model(kind: str, variant: int) -> ObjectModel:
    """The same as a snap is told of it: its mesh may be a little wrong, its symmetries unknown."""
    rng = np.random.default_rng([variant, sorted(KINDS).index(kind)])
    model = true_model(kind, variant)
    told = imprecise(model, rng) if rng.random() < IMPRECISE else model
    return replace(told, symmetries=Symmetries()) if rng.random() < UNDECLARED else told


def start_on(shell: int, T_camera_object: Array, model: ObjectModel, rng: np.random.Generator) -> Array:
    """A pose (4, 4) on a shell of SHELLS about the true one."""
    translation, degrees = SHELLS[shell]
    to_centre = pose.from_rotation_translation(np.eye(3), model.centre)
    away = pose.perturbed(T_camera_object @ to_centre, translation, np.radians(degrees), rng)
    return away @ pose.inverse(to_centre)


def started_run(
    model: ObjectModel,
    depth: NDArray[np.float32],
    color: NDArray[np.uint8] | None,
    view: Picture,
    start: Array,
    seed: int,
) -> SnapRun | None:
    """A snap about to begin; None where nothing of the object could be seen from there."""
    try:
        problem = checked_problem(model, depth, view.camera, start, SnapConfig(), None, None, color)
    except ValueError:
        return None
    search = search_of(problem, np.random.default_rng(seed))
    return SnapRun((Sighting(search, np.eye(4)),), seed, 0.0) if search.sees_enough else None


def _trial(
    run: SnapRun, kind: str, variant: int, family: str, shell: int, view: Picture, seen: Seen
) -> Trial:
    model = true_model(kind, variant)
    parts = [np.concatenate([run.problem.prior.start[None], run.polished_start()])]
    parts += [_last(run.round(one.share, one.widening)) for one in run.problem.config.rounds]
    poses = np.concatenate(parts)
    twins = [other.T_camera_object for other in view.seen if other.index == seen.index]
    twins.append(as_measured(run, seen.T_camera_object))
    mean, largest = distances(run.problem.uncentred(from_rows(poses)), twins, model)
    return Trial(
        kind=kind,
        variant=variant,
        family=family,
        shell=shell,
        near=len(NEAR_TUKEY),
        ends=tuple(np.cumsum([len(part) for part in parts]).tolist()),
        poses=poses,
        counts=run.evidence(poses),
        tails=heavy_tails(poses, run.problem.prior),
        right=mean < RIGHT * model.diameter,
        exact=largest < EXACT * model.diameter,
        spreads=run.spreads(poses),
    )


def as_measured(run: SnapRun, T_camera_object: Array) -> Array:
    """Where the measured depth shows an object that truly is at a pose (4, 4): poses in real data sets are
    found by depth as well, and no snap can know what the sensor is off by.
    """
    problem = run.problem
    truth = to_rows(centred(T_camera_object, problem.model.centre))
    return problem.uncentred(
        from_rows(run.sightings[0].search.polished(truth, NEAR_ITERATIONS, TRUTH_TUKEY))
    )[0]


def distances(poses: Array, truths: Sequence[Array], model: ObjectModel) -> tuple[Array, Array]:
    """Mean and largest distance (N,) of surface points at poses (N, 4, 4) from where they truly are, least
    over the copies in the scene and the symmetries.
    """
    points = model.vertices[np.linspace(0, len(model.vertices) - 1, POINTS).astype(int)]
    placed = pose_applied(poses, points)
    mean, largest = np.full(len(poses), np.inf), np.full(len(poses), np.inf)
    for twin in model.symmetries.transforms(model.diameter, SYMMETRY_STEP):
        for T in truths:
            apart = np.linalg.norm(placed - pose.apply(T @ twin, points), axis=2)
            mean, largest = np.minimum(mean, apart.mean(axis=1)), np.minimum(largest, apart.max(axis=1))
    return mean, largest


def pose_applied(poses: Array, points: Array) -> Array:
    """Points (P, 3) at each of the poses (N, 4, 4): (N, P, 3)."""
    return np.einsum("nij,pj->npi", poses[:, :3, :3], points) + poses[:, None, :3, 3]


def _last(steps: Iterator[Array32]) -> Array32:
    *_, last = steps
    return last


def _is_well_within(view: Picture, seen: Seen, model: ObjectModel) -> bool:
    column, row = project(pose.apply(seen.T_camera_object, model.centre), view.camera)
    camera = view.camera
    return bool(BORDER < column < camera.width - BORDER and BORDER < row < camera.height - BORDER)
