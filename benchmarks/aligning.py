"""One scripted operator aligning one object: every technique, with what it takes."""

import time
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import httpx
import numpy as np
from scipy.ndimage import binary_erosion

from app.datasets.scene_data import camera_of
from app.study.simulated.motor_model import CLICK, CLOSE, DECIDE, KEY, next_stroke
from benchmarks.operators import ENDED, Operator, Stream
from benchmarks.registration.judging import Judge
from benchmarks.scenes import KnownTask
from benchmarks.viser_client import Array, ViewClient
from registration_core import ObjectModel
from registration_core.geometry import pose
from registration_core.geometry.camera import depth_to_points, project
from registration_core.rendering.rasterizer import render_depth

NEAR = np.array([0.08, np.radians(40.0)])
"""Metres and radians from which an operator trusts a snap to do the rest."""
MOST_ACTIONS = 60
"""After which an operator gives up."""
SECONDS_TO_LOOK = 1.0
"""For how long an operator looks for a ghost after letting go."""
SHOWN = 0.006
"""Metres between surface and measurement where the surface is seen."""
FROM_EDGE = 5
"""Pixels that a person keeps from the edge of what is clicked."""
POINTING = 0.004
"""Standard deviation of where a click goes, metres on the object."""
LEAST_WEIGHT, MOST_FOUND = 0.05, 5
"""Of the poses that a snap leaves and of those that a search finds, which ones the page shows as pictures."""
REFUSALS = frozenset({httpx.codes.UNPROCESSABLE_ENTITY, httpx.codes.CONFLICT})
"""Of what was clicked."""


@dataclass(eq=False)
class Alignment:
    """One operator before one object; `actions` and `seconds` grow with what it does.

    A drag, a click, a double click and a key are one action each. Seconds are those that the scripted hand
    takes by its model, and those that it really had to wait for the application.
    """

    operator: Operator
    registration_id: int
    stream: Stream
    view: ViewClient
    task: KnownTask
    model: ObjectModel
    """With the symmetries that depth leaves the object."""
    rng: np.random.Generator
    actions: int = 0
    seconds: float = 0.0
    judge: Judge = field(init=False)

    def __post_init__(self) -> None:
        self.judge = Judge(self.model)

    def is_aligned(self, T_world_object: object) -> bool:
        """Within 5 mm and 5 degrees of the truth."""
        return self._is_within(np.array(T_world_object), CLOSE)

    async def pose(self) -> Array:
        """Where the object is."""
        now = await self.operator.call("GET", f"/api/registrations/{self.registration_id}")
        return np.array(now["T_world_object"])

    async def drag(self) -> Array:
        """One drag towards where the object belongs; returns where it then is."""
        T_object_gizmo = pose.from_rotation_translation(np.eye(3), self.task.model.centre)
        T_world_gizmo = await self.pose() @ T_object_gizmo
        stroke = next_stroke(T_world_gizmo, self._nearest_twin(T_world_gizmo, T_object_gizmo), self.rng)
        self._took(1, stroke.seconds)
        await self.view.drag(stroke.path)
        end = stroke.path[-1] @ pose.inverse(T_object_gizmo)
        await self.stream.until_at(end)
        return end

    async def press(self, act: Callable[[], Awaitable[Any]]) -> Any:
        """One key, and the wait for what it does."""
        self._took(1, DECIDE + KEY)
        return await self._waited(act())

    async def click(self, act: Callable[[], Awaitable[Any]]) -> Any:
        """One click, and the wait for what it does."""
        self._took(1, CLICK)
        return await self._waited(act())

    async def snap(self) -> Array:
        """Press Snap, and click another pose that the depth fits alike where that one is right.

        Returns:
            Where the object then is (4, 4).
        """

        async def act() -> dict[str, Any]:
            snap_id = await self.operator.request_snap(self.registration_id)
            return await self.stream.until_snap_ended(snap_id)

        registration = await self.press(act)
        if not self.is_aligned(await self.pose()):
            await self._choose(f"/api/snaps/{registration['snap']['id']}")
        return await self.pose()

    async def _choose(self, snap_url: str) -> None:
        estimate = (await self.operator.call("GET", snap_url))["estimate"]
        shown = [one for one in estimate["hypotheses"] if one["weight"] >= LEAST_WEIGHT]
        T_world_camera = np.array(self.task.frame.T_world_camera)
        for one in shown:
            T_world_object = T_world_camera @ np.array(one["T_camera_object"])
            if self.is_aligned(T_world_object):
                await self.click(lambda: self.operator.set_pose(self.registration_id, T_world_object))  # noqa: B023 - awaited here
                return

    async def post(self, action: str, body: object = None) -> Any:
        """A REST call on the registration."""
        return await self.operator.call("POST", f"/api/registrations/{self.registration_id}/{action}", body)

    async def look_for_ghost(self) -> bool:
        """Whether a ghost that is right shows up before the operator has lost patience."""
        try:
            await self._waited(
                self.stream.until(
                    lambda now: now["live"] is not None and self.is_aligned(now["live"]["T_world_object"]),
                    SECONDS_TO_LOOK,
                )
            )
        except TimeoutError:
            return False
        return True

    def distance(self, T_world_object: Array) -> float:
        """From the truth, measured in `CLOSE`; of translation and rotation the worse."""
        error = self.judge.error(T_world_object, self.task.T_world_object)
        return float(max(error.translation / CLOSE[0], error.rotation / CLOSE[1]))

    def is_near(self, T_world_object: Array) -> bool:
        """Whether a snap from there is worth trying."""
        return self._is_within(T_world_object, NEAR)

    def misses(self, point: Array) -> Array:
        """Where a click goes that means this point (3,)."""
        return point + POINTING * self.rng.normal(size=3)

    def _took(self, actions: int, seconds: float) -> None:
        self.actions += actions
        self.seconds += seconds

    async def _waited(self, answer: Awaitable[Any]) -> Any:
        began = time.perf_counter()
        try:
            return await answer
        finally:
            self.seconds += time.perf_counter() - began

    def _is_within(self, T_world_object: Array, limits: Array) -> bool:
        error = self.judge.error(T_world_object, self.task.T_world_object)
        return bool(error.translation <= limits[0] and error.rotation <= limits[1])

    def _nearest_twin(self, T_world_gizmo: Array, T_object_gizmo: Array) -> Array:
        twins = self.task.T_world_object @ self.model.symmetry_transforms @ T_object_gizmo
        turns = [pose.distance(T_world_gizmo, twin).rotation for twin in twins]
        return twins[int(np.argmin(turns))]


async def by_gizmo(work: Alignment) -> None:
    """Drags alone."""
    while work.actions < MOST_ACTIONS and not work.is_aligned(await work.pose()):
        await work.drag()


async def by_gizmo_and_snap(work: Alignment) -> None:
    """Drags until a snap may do it, and the snap, which is undone where it led away; drags do the rest."""
    while work.actions < MOST_ACTIONS and not work.is_near(await work.pose()):
        await work.drag()
    before = await work.pose()
    if not work.is_aligned(before) and work.distance(await work.snap()) > work.distance(before):
        await work.press(lambda: work.post("undo"))
    await by_gizmo(work)


async def by_live_snap(work: Alignment) -> None:
    """Drags until the ghost is where it should be, and the key that takes it."""
    await work.operator.call("PUT", f"/api/registrations/{work.registration_id}/live", {"on": True})
    while work.actions < MOST_ACTIONS and not work.is_aligned(await work.pose()):
        await work.drag()
        if await work.look_for_ghost():
            await work.press(lambda: work.post("accept"))


async def by_three_points(work: Alignment) -> None:
    """A key and three pairs of clicks, after which the machine snaps; then as with the gizmo.

    Pairs that do not fit together, or where no depth was measured, are refused, and clicked again.
    """
    T_camera_object = pose.inverse(np.array(work.task.frame.T_world_camera)) @ work.task.T_world_object
    points = _far_apart(visible_points(work.task, T_camera_object), 3)
    await work.press(_nothing)
    is_placed = False
    while not is_placed and work.actions < MOST_ACTIONS:
        is_placed = await _click_pairs(work, T_camera_object, points)
    if not work.is_aligned(await work.pose()):
        await by_gizmo_and_snap(work)


async def _click_pairs(work: Alignment, T_camera_object: Array, points: Array) -> bool:
    """Click points (N, 3) of the object and of the scene; tells whether the pairs were taken."""
    pairs = []
    for on_object in points:
        in_scene = clicked_pixel(work.task, T_camera_object, work.misses(on_object))
        pairs.append({"on_object": work.misses(on_object).tolist(), "in_scene": in_scene})
    for _ in range(2 * len(pairs) - 1):
        await work.click(_nothing)

    async def finish() -> bool:
        try:
            answer = await work.post("three-points", {"pairs": pairs})
        except httpx.HTTPStatusError as refusal:
            if refusal.response.status_code not in REFUSALS:
                raise
            return False
        await work.stream.until_snap_ended(answer["snap_id"])
        return True

    return bool(await work.click(finish))


async def by_finding(work: Alignment) -> None:
    """The key that looks for the object, and the picture that is right; then drags.

    What a search finds has been polished as a snap polishes: another one would change nothing.
    """

    async def find() -> Any:
        search_id = (await work.post("searches", {}))["id"]
        await work.stream.until(lambda now: now["search"] is not None and now["search"]["state"] in ENDED)
        return (await work.operator.call("GET", f"/api/searches/{search_id}"))["candidates"]

    T_world_camera = np.array(work.task.frame.T_world_camera)
    found = [T_world_camera @ np.array(one["T_camera_object"]) for one in await work.press(find)]
    best = min(found[:MOST_FOUND], key=work.distance, default=None)
    if best is not None:
        await work.click(lambda: work.operator.set_pose(work.registration_id, best))
    await by_gizmo(work)


async def by_click_and_snap(work: Alignment) -> None:
    """A double click on the object in the image, and a snap; then drags, or all of it where it is far off."""
    T_camera_object = pose.inverse(np.array(work.task.frame.T_world_camera)) @ work.task.T_world_object
    pixel = clicked_pixel(work.task, T_camera_object, work.misses(work.task.model.centre))
    await work.click(lambda: work.post("place", pixel))
    rest = by_gizmo if work.is_near(await work.snap()) else by_gizmo_and_snap
    await rest(work)


async def _nothing() -> None:
    """What a key or click does that only prepares the next one."""


def clicked_pixel(task: KnownTask, T_camera_object: Array, point: Array) -> dict[str, float]:
    """A click in the image at a point (3,) in the object's frame, as REST takes it."""
    frame = task.frame
    column, row = project(pose.apply(T_camera_object, point), camera_of(frame))
    return {"frame_id": frame.id, "column": float(column), "row": float(row)}


def visible_points(task: KnownTask, T_camera_object: Array) -> Array:
    """Points (N, 3) of the surface, in the object's frame, that the image shows, away from edges."""
    camera = camera_of(task.frame)
    rendered = render_depth(task.model, camera, T_camera_object)
    shown = (rendered > 0) & (np.abs(rendered - task.depth) < SHOWN)
    inner = binary_erosion(shown, iterations=FROM_EDGE)
    shown = inner if inner.any() else shown
    return pose.apply(pose.inverse(T_camera_object), depth_to_points(rendered, camera)[shown])


def _far_apart(points: Array, count: int) -> Array:
    """Some of the points (N, 3), each as far as can be from those before."""
    chosen = [points[np.linalg.norm(points - points.mean(axis=0), axis=1).argmax()]]
    while len(chosen) < count:
        distance = np.min([np.linalg.norm(points - one, axis=1) for one in chosen], axis=0)
        chosen.append(points[distance.argmax()])
    return np.array(chosen)


TECHNIQUES: Mapping[str, Callable[[Alignment], Awaitable[None]]] = {
    "gizmo": by_gizmo,
    "gizmo and snap": by_gizmo_and_snap,
    "live snap": by_live_snap,
    "click-to-place and snap": by_click_and_snap,
    "three points": by_three_points,
    "find it": by_finding,
}
