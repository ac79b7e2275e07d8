"""The research prototype as a peer: it lies beside the project, is no part of it, and is only called here.

It gets its own model of each object, made from the same mesh, and warm kernels, before anything is timed.
"""

import importlib
import sys
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numba
import numpy as np
import trimesh
from numpy.typing import NDArray

from benchmarks import PROJECT
from benchmarks.registration.instances import Instance
from registration_core import ObjectModel
from registration_core.geometry import pose

Array = NDArray[np.float64]

FOLDER = PROJECT.parent / "shared" / "reference" / "registration" / "snap_prototype"
KERNELS = PROJECT / "test-results" / "prototype_kernels"
"""Where its compiled code is kept: numba would put it beside the source, in a folder that is not ours."""
WALL = 0.6
"""Metres: before it, every kernel runs once."""


@dataclass(frozen=True)
class _Code:
    pipe: Any
    """Its pipeline."""
    scenes: Any
    """What makes its models of objects."""
    weights: Array
    """Of its ranker."""


@dataclass(frozen=True)
class _Known:
    """An object that equals every copy of itself."""

    content_hash: str
    model: ObjectModel = field(compare=False)


def is_there() -> bool:
    """Whether the prototype lies beside the project."""
    return FOLDER.is_dir()


def prepare(model: ObjectModel) -> None:
    """Load or compile its kernels and make its model of the object; once a process and object."""
    _prepared(_Known(model.content_hash, model))


def prototype_snap(instance: Instance, T_start: Array, seed: int) -> Array:
    """The pose (4, 4) that the prototype makes of a start (4, 4)."""
    model, camera = instance.model, instance.camera
    T_object_centre = pose.from_rotation_translation(np.eye(3), model.centre)
    K = np.array([camera.fx, camera.fy, camera.cx, camera.cy])
    prepared = _prepared(_Known(model.content_hash, model))
    T_camera_centre = _snap(prepared, instance.depth, K, T_start @ T_object_centre, seed)
    return pose.orthonormalised(T_camera_centre @ pose.inverse(T_object_centre))


@cache
def _prepared(known: _Known) -> Any:
    code, model = _code(), known.model
    mesh = trimesh.Trimesh(model.vertices - model.centre, model.faces, process=False)
    views, coarse = code.scenes.view_model(mesh), code.scenes.decimate(mesh)
    prepared = code.pipe.Model({"mesh": mesh, "vm": views, "low": coarse, "diam": model.diameter})
    T_wall = pose.from_rotation_translation(np.eye(3), np.array([0.0, 0.0, WALL]))
    wall, K = np.full((240, 320), WALL, np.float32), np.array([280.0, 280.0, 159.5, 119.5])
    _snap(prepared, wall, K, T_wall, 0)
    return prepared


def _snap(prepared: Any, depth: NDArray[np.float32], K: Array, T_camera_centre: Array, seed: int) -> Array:
    code = _code()
    return code.pipe.snap(prepared, depth, K, T_camera_centre, {"wts": code.weights, "seed": 1 + seed})[0]


@cache
def _code() -> _Code:
    """Its modules, which import each other by bare names; nothing is written into their folder."""
    before = sys.dont_write_bytecode, numba.config.CACHE_DIR
    sys.dont_write_bytecode, numba.config.CACHE_DIR = True, str(KERNELS)
    sys.path.insert(0, str(FOLDER))
    try:
        pipe, scenes = importlib.import_module("pipe"), importlib.import_module("scenes")
    finally:
        sys.path.remove(str(FOLDER))
        sys.dont_write_bytecode, numba.config.CACHE_DIR = before
    return _Code(pipe, scenes, np.load(FOLDER / "wts_train2.npy"))
