"""Snaps on the small dataset, as they are handed to workers, and what tests ask of a snapper."""

import os
import uuid
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np

from app.storage.files import PreparedStore
from app.workers import jobs
from app.workers.jobs import JobView, SnapJob
from app.workers.pool import SnapError, Snapper
from registration_core import Estimate, Intrinsics, ObjectModel, SnapConfig, snap
from registration_core.algorithm import VIEWPOINT_ALGORITHM
from registration_core.geometry import pose
from tests.app.export.site import CAMERA, NEAR_VIEW, T_WORLD_TOOL, TOOL, mesh_of, model_of, observed_depth
from tests.app.waiting import LONGEST

DEPTH = observed_depth(NEAR_VIEW)
T_CAMERA_TOOL = pose.inverse(NEAR_VIEW) @ T_WORLD_TOOL
START = pose.perturbed(T_CAMERA_TOOL, 0.01, 0.15, np.random.default_rng(1))
SEED = 11


def new_model() -> ObjectModel:
    """The angle tool, slightly different each time, so that no worker has seen it."""
    model = model_of(mesh_of(TOOL))
    noise = np.random.default_rng(uuid.uuid4().int).uniform(-1e-5, 1e-5, model.vertices.shape)
    return ObjectModel(model.vertices + noise, model.faces)


def view_of(depth: np.ndarray, camera: Intrinsics) -> JobView:
    """The one image of a snap whose poses are in its camera."""
    return JobView(depth, camera, np.eye(4), None, None)


def new_job(model: ObjectModel, topic: str = "", config: SnapConfig | None = None, **changes: Any) -> SnapJob:
    """A snap of the tool from nearby."""
    fields: dict[str, Any] = {
        "snap_id": uuid.uuid4().hex,
        "topic": topic,
        "model_hash": model.content_hash,
        "views": (view_of(DEPTH, CAMERA),),
        "used": 1,
        "T_camera_object": START,
        "config": config or SnapConfig(),
        "seed": SEED,
        "start_spread": None,
    }
    return SnapJob(**(fields | changes))


def done_here(job: SnapJob, model: ObjectModel) -> Estimate:
    """What the same snap gives in this process."""
    rng = np.random.default_rng(job.seed)
    (view,) = job.views
    return snap(model, view.depth, view.camera, job.T_camera_object, job.config, rng, job.start_spread)


def assert_same(a: Estimate, b: Estimate) -> None:
    """Equal to the last bit, but for the time it took."""
    assert np.array_equal(a.T_camera_object, b.T_camera_object)
    assert np.array_equal(a.covariance, b.covariance)
    assert (a.confidence, a.evaluations, a.converged, a.seed) == (
        b.confidence, b.evaluations, b.converged, b.seed
    )  # fmt: skip
    for one, other in zip(a.hypotheses, b.hypotheses, strict=True):
        assert np.array_equal(one.T_camera_object, other.T_camera_object) and one.weight == other.weight


@dataclass
class Outcome:
    """What a snap told."""

    shares: list[float] = field(default_factory=list)
    moved: Event = field(default_factory=Event)
    ended: Event = field(default_factory=Event)
    ends: list[Estimate | SnapError] = field(default_factory=list)

    def on_progress(self, share: float) -> None:
        self.shares.append(share)
        self.moved.set()

    def on_end(self, outcome: Estimate | SnapError) -> None:
        self.ends.append(outcome)
        self.ended.set()


def store_in(folder: Path) -> PreparedStore:
    """Where snappers of a test keep what they build."""
    return PreparedStore(folder, VIEWPOINT_ALGORITHM)


def request(snapper: Snapper, job: SnapJob, model: ObjectModel) -> tuple[Outcome, Callable[[], None]]:
    """Ask for a snap; what it tells, and the function that cancels it."""
    outcome = Outcome()
    return outcome, snapper.request(job, model, outcome.on_progress, outcome.on_end)


def result_of(outcome: Outcome) -> Estimate | SnapError:
    """What it came to."""
    assert outcome.ended.wait(LONGEST)
    (end,) = outcome.ends
    return end


def pids(snapper: Snapper) -> set[int]:
    """Of the worker processes."""
    return set(snapper.client().run(os.getpid).values())


def knowing(snapper: Snapper, digest: str) -> int:
    """How many workers know an object."""
    return sum(not lacking for lacking in snapper.client().run(jobs.lacking, [digest]).values())
