"""One pose against several views at once: modes of each view, polished and judged by all of them."""

import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import fields, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from registration_core.config import SnapConfig
from registration_core.estimate import Estimate, Hypothesis, SnapStep, WorldEstimate
from registration_core.geometry import pose
from registration_core.geometry.camera import Intrinsics
from registration_core.search.snap_input import (
    CheckedView,
    OutOfViewError,
    SnapInput,
    checked_view,
    snap_input_of,
)
from registration_core.search.viewpoint_model import Registrable
from registration_core.seeding import seed_of
from registration_core.snap import steps_of
from registration_core.snap_run import Sighting, SnapRun, Witness
from registration_core.view_search import search_of

Array = NDArray[np.float64]
View = tuple[ArrayLike, Intrinsics, ArrayLike]
"""Depth (H, W) in metres, its camera, and `T_world_camera` (4, 4)."""


def snap_views(
    model: Registrable,
    views: Sequence[View],
    T_world_object: ArrayLike,
    config: SnapConfig | None = None,
    rng: np.random.Generator | None = None,
    start_spread: tuple[float, float] | None = None,
    explained: Sequence[ArrayLike | None] | None = None,
    used: int | None = None,
    colors: Sequence[ArrayLike | None] | None = None,
) -> WorldEstimate:
    """Refine the operator's pose of an object against several depth images of a scene that stands still.

    The proposals of a snap are shared out among the views, so that it takes about as long as one in a single
    view; what is found in any is polished and judged by all of them.

    Args:
        views: depth (H, W) in metres, camera and `T_world_camera` (4, 4) of each; those whose image the
            object lies outside of are left out.
        T_world_object: (4, 4), the operator's pose.
        config: `SnapConfig()` where it is None; the fast method is the only one.
        rng: as for `snap`.
        start_spread: as for `snap`.
        explained: as for `snap`, one for each view, None for a view without.
        colors: as `color` for `snap`, one for each view, None for a view without.
        used: so many of the views, the first ones, are used; the others are only asked at the end whether
            they agree: `Certificates.unused`. All are used where it is None.

    Raises:
        ValueError: naming the argument that is wrong, and how.
    """
    for step in snap_views_steps(
        model, views, T_world_object, config, rng, start_spread, explained, used, colors
    ):
        if isinstance(step.estimate, WorldEstimate):
            return step.estimate
    raise AssertionError("the last step carries the estimate")


def snap_views_steps(
    model: Registrable,
    views: Sequence[View],
    T_world_object: ArrayLike,
    config: SnapConfig | None = None,
    rng: np.random.Generator | None = None,
    start_spread: tuple[float, float] | None = None,
    explained: Sequence[ArrayLike | None] | None = None,
    used: int | None = None,
    colors: Sequence[ArrayLike | None] | None = None,
) -> Iterator[SnapStep]:
    """`snap_views` step by step, as `snap_steps`; the world takes the place of the camera in every step.

    Inputs are checked at once, not when the first step is asked for.
    """
    started = time.perf_counter()
    config = SnapConfig() if config is None else config
    if len(views) == 0:
        raise ValueError("views must hold at least one view; there is none")
    used = len(views) if used is None else used
    if not 1 <= used <= len(views):
        raise ValueError(f"used must be from 1 to the number of views, {len(views)}; it is {used!r}")
    if config.method != "viewpoint" and used > 1:
        raise ValueError("config.method must be 'viewpoint': the particle filter uses one view only")
    masks = _one_a_view(explained, len(views), "explained must hold a mask")
    images = _one_a_view(colors, len(views), "colors must hold an image")
    T_start = pose.checked(T_world_object, "T_world_object")
    checked = [_checked(number, *view) for number, view in enumerate(zip(views, masks, images, strict=True))]
    problems = _problems(model, checked[:used], T_start, config, start_spread)
    seed = seed_of(rng)
    rng = np.random.default_rng(seed)
    searches = [(search_of(problem, rng), T_world_camera) for problem, T_world_camera in problems]
    searches = [one for one in searches if one[0].sees_enough] or searches[:1]
    T_world_first = searches[0][1]
    sightings = [Sighting(search, pose.inverse(T) @ T_world_first) for search, T in searches]
    witnesses = [
        Witness(view.depth, view.camera, pose.inverse(T) @ T_world_first, view.explained)
        for view, T in checked[used:]
    ]
    run = SnapRun(tuple(sightings), seed, started, tuple(witnesses))
    return (_in_world(step, T_world_first, T_start, run.problem.T_camera_object) for step in steps_of(run))


def _one_a_view(
    images: Sequence[ArrayLike | None] | None, views: int, what: str
) -> Sequence[ArrayLike | None]:
    if images is None:
        return [None] * views
    if len(images) != views:
        raise ValueError(f"{what} or None for each of the views, {views}; it has {len(images)}")
    return images


def _checked(
    number: int, view: View, explained: ArrayLike | None, color: ArrayLike | None
) -> tuple[CheckedView, Array]:
    depth, camera, T_world_camera = view
    try:
        return checked_view(depth, camera, explained, color), pose.checked(T_world_camera, "T_world_camera")
    except ValueError as error:
        raise ValueError(f"views[{number}]: {error}") from error


def _problems(
    model: Registrable,
    views: Sequence[tuple[CheckedView, Array]],
    T_world_object: Array,
    config: SnapConfig,
    start_spread: tuple[float, float] | None,
) -> list[tuple[SnapInput, Array]]:
    """What is to be done in each view that may show the object, and its `T_world_camera` (4, 4)."""
    found = []
    for view, T_world_camera in views:
        # not made rigid once more: a view at the world's origin gives to the last bit what `snap` gives
        T_camera_object = pose.inverse(T_world_camera) @ T_world_object
        with suppress(OutOfViewError):
            found.append((snap_input_of(model, view, T_camera_object, config, start_spread), T_world_camera))
    if not found:
        raise ValueError("T_world_object puts the object wholly outside the image of every view")
    return found


def _in_world(step: SnapStep, T_world_first: Array, T_start: Array, T_first_start: Array) -> SnapStep:
    """A step whose poses are in the first camera as one in the world; the start stays as it came."""

    def moved(T: Array) -> Array:
        return T_start if np.array_equal(T, T_first_start) else T_world_first @ T

    def moved_estimate(known: Estimate) -> WorldEstimate:
        values = {field.name: getattr(known, field.name) for field in fields(known)}
        to_world = np.kron(np.eye(2), T_world_first[:3, :3])
        values["T_camera_object"] = moved(known.T_camera_object)
        values["covariance"] = to_world @ known.covariance @ to_world.T
        hypotheses = [Hypothesis(moved(one.T_camera_object), one.weight) for one in known.hypotheses]
        return WorldEstimate(**{**values, "hypotheses": tuple(hypotheses)})

    return replace(
        step,
        T_camera_object=moved(step.T_camera_object),
        particles=T_world_first @ step.particles,
        estimate=None if step.estimate is None else moved_estimate(step.estimate),
    )
