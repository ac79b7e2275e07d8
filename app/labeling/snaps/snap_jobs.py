"""Turns the orders of one session into jobs for the workers, and what they bring into poses in the world."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from app.confidence.assessment import Standard, assess
from app.datasets.scene_data import SceneData, camera_of
from app.labeling.scene.neighbours import Neighbours
from app.labeling.snaps.find import SearchOrder
from app.labeling.snaps.session_object import SessionObject
from app.labeling.snaps.snap_exchange import SnapOrder, SnapResult
from app.storage.tables import Frame
from app.workers.jobs import JobView, Proposals, SearchJob, SnapJob
from app.workers.pool import SnapError, Snapper
from registration_core import Estimate, ObjectModel
from registration_core.geometry import pose
from registration_core.search.snap_input import region_of_interest

LIVE_PRIORITY = -1
"""Where workers have to choose, they do what somebody waits for first."""


class Dispatch:
    """`snap` and `search` are what a session submits its orders to.

    Args:
        snapper: Runs jobs.
        data: Where depth and colour come from.
        frames: The scene's frames, by id.
        sought: What is looked for.
        neighbours: Tells which pixels other objects explain.
        standard: Tells what is asked of an estimate.
    """

    def __init__(
        self,
        snapper: Snapper,
        data: SceneData,
        frames: Mapping[int, Frame],
        sought: SessionObject,
        neighbours: Neighbours,
        standard: Callable[[], Standard],
    ) -> None:
        self._snapper = snapper
        self._data = data
        self._frames = frames
        self._sought = sought
        self._neighbours = neighbours
        self._standard = standard

    def snap(
        self,
        order: SnapOrder,
        on_progress: Callable[[float], None],
        on_end: Callable[[SnapResult | SnapError], None],
    ) -> Callable[[], None]:
        """Let a worker look for a better pose; returns a function that cancels it."""
        T_world_camera = np.array(self._frames[order.frame_id].T_world_camera)
        sought = self._sought.present

        def ended(outcome: Estimate | SnapError) -> None:
            if isinstance(outcome, SnapError):
                on_end(outcome)
                return
            T_world_object = T_world_camera @ outcome.T_camera_object
            assessment = assess(outcome, self._standard(), sought.model)
            on_end(SnapResult(outcome, T_world_object, sought.symmetries_version, assessment))

        try:
            job = self._snap_job(order, sought.model)
        except ValueError as error:
            on_end(SnapError(f"The snap cannot work on this: {error}."))
            return lambda: None
        priority = LIVE_PRIORITY if order.is_live else 0
        return self._snapper.request(job, sought.model, on_progress, ended, priority)

    def search(
        self,
        order: SearchOrder,
        on_progress: Callable[[float], None],
        on_end: Callable[[Proposals | SnapError], None],
    ) -> Callable[[], None]:
        """Let a worker look where the object may be; returns a function that cancels it."""
        model = self._sought.present.model
        return self._snapper.request(self._search_job(order, model), model, on_progress, on_end)

    def _snap_job(self, order: SnapOrder, model: ObjectModel) -> SnapJob:
        T_shown_world = pose.inverse(np.array(self._frames[order.frame_id].T_world_camera))
        return SnapJob(
            snap_id=order.snap_id,
            topic="" if order.is_live else self._snapper.topic,
            model_hash=model.content_hash,
            config=order.config,
            seed=order.seed,
            views=tuple(
                self._view(order, self._frames[frame_id], T_shown_world, model)
                for frame_id in (*order.frames.used, *order.frames.others)
            ),
            used=len(order.frames.used),
            T_camera_object=T_shown_world @ order.T_world_object,
            start_spread=order.start_spread,
        )

    def _view(
        self, order: SnapOrder, frame: Frame, T_shown_world: NDArray[np.float64], model: ObjectModel
    ) -> JobView:
        explained = self._neighbours.explained(frame, order.known)
        camera, T_world_camera = camera_of(frame), np.array(frame.T_world_camera)
        T_camera_object = pose.inverse(T_world_camera) @ order.T_world_object
        whole = self._data.depth(frame)
        is_searched = frame.id in order.frames.used  # others only check what is found, by their depth
        color = self._data.aligned_color(frame) if is_searched else None
        try:
            left, top, width, height = region_of_interest(model, camera, T_camera_object, order.config)
        except ValueError as error:
            raise ValueError(f"frame {frame.image_id}: {error}") from error
        if not whole[top : top + height, left : left + width].any():
            left, top, (height, width) = 0, 0, whole.shape  # nothing near is no error, nothing seen at all is
        rows, columns = slice(top, top + height), slice(left, left + width)
        return JobView(
            depth=np.ascontiguousarray(whole[rows, columns]),
            camera=camera.cropped(left, top, width, height),
            T_shown_camera=np.eye(4) if frame.id == order.frame_id else T_shown_world @ T_world_camera,
            explained=None if explained is None else np.ascontiguousarray(explained[rows, columns]),
            color=None if color is None else np.ascontiguousarray(color[rows, columns]),
        )

    def _search_job(self, order: SearchOrder, model: ObjectModel) -> SearchJob:
        frame = self._frames[order.frame_id]
        explained = self._neighbours.explained(frame, order.known)
        depth = self._data.depth(frame)
        return SearchJob(
            snap_id=order.search_id,
            topic=self._snapper.topic,
            model_hash=model.content_hash,
            depth=depth if explained is None else np.where(explained, 0.0, depth),
            camera=camera_of(frame),
            config=order.config,
            seed=order.seed,
            region=order.region,
        )
