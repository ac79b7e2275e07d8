"""Snaps on the small dataset, as they are handed to workers."""

import uuid
from dataclasses import dataclass, field
from threading import Event

import numpy as np
import pytest

from app.snapping import SnapError
from app.worker import JobResult, JobView, SnapJob
from registration_core import Estimate, Intrinsics, ObjectModel, SnapConfig, pose, snap
from tests.app.export.site import CAMERA, NEAR_VIEW, T_WORLD_TOOL, TOOL, mesh_of, model_of, observed_depth

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


def new_job(
    model: ObjectModel, topic: str = "", config: SnapConfig | None = None, **changes: object
) -> SnapJob:
    """A snap of the tool from nearby."""
    fields = {
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
    """Equal but for the time it took: poses to the last bit; the rest up to rounding, since a snap in a view
    and one in views that are just one may differ in their last digits.
    """
    assert np.array_equal(a.T_camera_object, b.T_camera_object)
    assert np.array_equal(a.covariance, b.covariance)
    assert (a.evaluations, a.converged, a.seed) == (b.evaluations, b.converged, b.seed)
    assert a.confidence == pytest.approx(b.confidence, rel=1e-9)
    for one, other in zip(a.hypotheses, b.hypotheses, strict=True):
        assert np.array_equal(one.T_camera_object, other.T_camera_object)
        assert one.weight == pytest.approx(other.weight, rel=1e-9)


@dataclass
class Outcome:
    """What a snap told."""

    shares: list[float] = field(default_factory=list)
    moved: Event = field(default_factory=Event)
    ended: Event = field(default_factory=Event)
    ends: list[JobResult | SnapError] = field(default_factory=list)

    def on_progress(self, share: float) -> None:
        self.shares.append(share)
        self.moved.set()

    def on_end(self, outcome: JobResult | SnapError) -> None:
        self.ends.append(outcome)
        self.ended.set()
