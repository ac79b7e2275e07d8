"""One operator's registration of one object, as errors over time."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from app.analysis.trace.pose_errors import PoseErrors
from app.analysis.trace.trace import Trace
from app.storage.tables import Method

Array = NDArray[np.float64]
ErrorKind = Literal["translation", "rotation"]
ERROR_KINDS: tuple[ErrorKind, ...] = ("translation", "rotation")


METHODS: tuple[Method, ...] = get_args(Method)


@dataclass(frozen=True)
class TrialInfo:
    """Who registered what, and how."""

    registration_id: int
    operator: str
    """A participant's code; a name in ordinary work."""
    group: str
    mode: str
    condition: str
    scene: str
    object: str
    instance: int
    is_simulated: bool


@dataclass(frozen=True, eq=False)
class Snapped:
    """What snaps by one method give from the M samples of a trial."""

    errors: PoseErrors
    """(M,) each, NaN where there is none."""
    computed: NDArray[np.bool_]
    """(M,), from which samples a snap was computed, though it failed."""


@dataclass(frozen=True, eq=False)
class TrialTrace(TrialInfo):
    """What the curves are made of. Samples are 0.5 s apart, the last one is the end."""

    seconds: Array
    """(M,), since the scene was first seen."""
    active_seconds: Array
    """(M,), the same without the idle ones."""
    idle: NDArray[np.bool_]
    """(M,), whether nothing happened for 10 s or more about then."""
    errors: PoseErrors
    """Of the pose at these times."""
    stg: Mapping[Method, Snapped]
    """By the methods by which any was computed; in ordinary work whatever was made is under `default`."""

    def of_kind(self, kind: ErrorKind) -> Array:
        """Errors (M,) of the pose, metres or radians."""
        return self.errors.translation if kind == "translation" else self.errors.rotation

    def stg_of_kind(self, kind: ErrorKind, method: Method = "default") -> Array:
        """Errors (M,) after a snap from there, metres or radians, NaN where there is none."""
        if method not in self.stg:
            return np.full(len(self.seconds), np.nan)
        errors = self.stg[method].errors
        return errors.translation if kind == "translation" else errors.rotation

    def has_stg(self, method: Method = "default") -> bool:
        """Whether any snap by a method has a result."""
        return bool(np.isfinite(self.stg_of_kind("translation", method)).any())

    def missing_snaps(self, method: Method = "default") -> int:
        """Samples from which no snap by a method was computed."""
        return len(self.seconds) - (int(self.stg[method].computed.sum()) if method in self.stg else 0)


def traced(
    info: TrialInfo,
    trace: Trace,
    times: Array,
    errors: PoseErrors,
    stg: Mapping[Method, Snapped],
) -> TrialTrace:
    """Join what is known of a trial at the times (M,) of its trace."""
    seconds = times - trace.first_sight
    return TrialTrace(
        **vars(info),
        seconds=seconds,
        active_seconds=seconds - trace.idle_before(times),
        idle=trace.is_idle(times),
        errors=errors,
        stg=stg,
    )


def without_snaps(count: int) -> PoseErrors:
    """Errors of no snap at so many samples."""
    return PoseErrors(np.full(count, np.nan), np.full(count, np.nan))
