"""One scripted operator aligning one object: every technique, with what it takes."""

import time
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.hand import CLICK, CLOSE, DECIDE, KEY, next_stroke
from benchmarks.operators import Operator, Stream
from benchmarks.registration.judging import Judge
from benchmarks.scenes import KnownTask
from benchmarks.viser_client import Array, ViewClient
from registration_core import ObjectModel, pose

NEAR = np.array([0.08, np.radians(40.0)])
"""Metres and radians from which an operator trusts a snap to do the rest."""
MOST_ACTIONS = 60
"""After which an operator gives up."""
SECONDS_TO_LOOK = 1.0
"""For how long an operator looks for a ghost after letting go."""
POINTING = 0.004
"""Standard deviation of where a click goes, metres on the object."""


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
        """Press Snap; returns where the object then is."""

        async def act() -> dict[str, Any]:
            snap_id = await self.operator.request_snap(self.registration_id)
            return await self.stream.until_snap_ended(snap_id)

        await self.press(act)
        return await self.pose()

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

    def is_near(self, T_world_object: Array) -> bool:
        """Whether a snap from there is worth trying."""
        return self._is_within(T_world_object, NEAR)

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
    """Drags until a snap may do it, and the snap; where it goes wrong, it is undone, and drags go on."""
    while work.actions < MOST_ACTIONS and not work.is_aligned(await work.pose()):
        if work.is_near(await work.pose()) and not work.is_aligned(await work.snap()):
            await work.press(lambda: work.post("undo"))
            await work.drag()
        elif not work.is_aligned(await work.pose()):
            await work.drag()


async def by_live_snap(work: Alignment) -> None:
    """Drags until the ghost is where it should be, and the key that takes it."""
    await work.operator.call("PUT", f"/api/registrations/{work.registration_id}/live", {"on": True})
    while work.actions < MOST_ACTIONS and not work.is_aligned(await work.pose()):
        await work.drag()
        if await work.look_for_ghost():
            await work.press(lambda: work.post("accept"))


async def by_click_and_snap(work: Alignment) -> None:
    """A double click on the object in the image, and a snap; then as with the gizmo."""
    T_camera_object = pose.inverse(np.array(work.task.frame.T_world_camera)) @ work.task.T_world_object
    x, y, z = pose.apply(T_camera_object, work.model.centre) + POINTING * work.rng.normal(size=3)
    frame = work.task.frame
    pixel = {"column": frame.cx + frame.fx * x / z, "row": frame.cy + frame.fy * y / z}
    await work.click(lambda: work.post("place", {"frame_id": frame.id, **pixel}))
    if not work.is_aligned(await work.snap()):
        await by_gizmo_and_snap(work)


TECHNIQUES: Mapping[str, Callable[[Alignment], Awaitable[None]]] = {
    "gizmo": by_gizmo,
    "gizmo and snap": by_gizmo_and_snap,
    "live snap": by_live_snap,
    "click-to-place and snap": by_click_and_snap,
}
