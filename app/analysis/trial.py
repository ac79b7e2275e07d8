"""One operator's registration of one object, as errors over time."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from app.analysis.pose_errors import PoseErrors
from app.analysis.trace import Trace

Array = NDArray[np.float64]
ErrorKind = Literal["translation", "rotation"]
ERROR_KINDS: tuple[ErrorKind, ...] = ("translation", "rotation")


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
    stg_errors: PoseErrors
    """Of what a snap gives from there; NaN where there is none."""
    missing_snaps: int
    """Samples from which a snap is still to be computed; 0 in ordinary work, where none is."""

    def of_kind(self, kind: ErrorKind) -> Array:
        """Errors (M,) of the pose, metres or radians."""
        return self.errors.translation if kind == "translation" else self.errors.rotation

    def stg_of_kind(self, kind: ErrorKind) -> Array:
        """Errors (M,) after a snap from there, metres or radians, NaN where there is none."""
        return self.stg_errors.translation if kind == "translation" else self.stg_errors.rotation

    @property
    def has_stg(self) -> bool:
        """Whether any snap was computed."""
        return bool(np.isfinite(self.stg_errors.translation).any())


def traced(
    info: TrialInfo,
    trace: Trace,
    times: Array,
    errors: PoseErrors,
    stg_errors: PoseErrors,
    missing_snaps: int = 0,
) -> TrialTrace:
    """Join what is known of a trial at the times (M,) of its trace."""
    seconds = times - trace.first_sight
    return TrialTrace(
        **vars(info),
        seconds=seconds,
        active_seconds=seconds - trace.idle_before(times),
        idle=trace.is_idle(times),
        errors=errors,
        stg_errors=stg_errors,
        missing_snaps=missing_snaps,
    )


def without_snaps(count: int) -> PoseErrors:
    """Errors of no snap at so many samples."""
    return PoseErrors(np.full(count, np.nan), np.full(count, np.nan))
