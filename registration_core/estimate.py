"""What a snap returns."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from registration_core.algorithm import ALGORITHM
from registration_core.hardware import hardware
from registration_core.judge.ambiguity import Ambiguity
from registration_core.judge.certificates import Certificates

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One of the places where the object may be."""

    T_camera_object: Array
    """(4, 4)."""
    weight: float
    """Share of the belief, in [0, 1]; all hypotheses of an estimate sum to 1."""
    chance: float | None = None
    """Probability in [0, 1] that the object is there, MSSD below 5 % of the diameter, however few others
    there are; None where nobody asked, since of a snap's first hypothesis the confidence says it."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """A refined pose and what is known about it."""

    T_camera_object: Array
    """(4, 4)."""
    confidence: float
    """In [0, 1]: probability that the MSSD is below 5 % of the diameter."""
    covariance: Array
    """(6, 6), order (translation in camera axes [m], rotation vector in camera axes [rad])."""
    hypotheses: tuple[Hypothesis, ...]
    """The distinct modes, best first; symmetric twins are one."""
    seconds: float
    """Wall-clock time it took."""
    evaluations: int
    """Hypotheses compared with the image."""
    converged: bool
    """Whether the search settled: False where there was too little evidence to go on."""
    ambiguities: tuple[Ambiguity, ...]
    """What the depth does not tell about the pose; other modes first."""
    certificates: Certificates
    """What speaks for the pose beside the confidence."""
    seed: int
    """`snap(..., rng=np.random.default_rng(seed))` with the same inputs and `algorithm` gives it again."""
    algorithm: str = ALGORITHM
    """The hash of the numeric sources and fitted numbers that made it."""
    hardware: str = field(default_factory=hardware)
    """Names the machine that computed it."""


class WorldEstimate(Estimate):
    """An estimate from several views: the world takes the place of the camera in everything it holds."""

    @property
    def T_world_object(self) -> Array:
        """(4, 4), the same as `T_camera_object`."""
        return self.T_camera_object


@dataclass(frozen=True, eq=False)
class SnapStep:
    """The state of a snap after one iteration."""

    iteration: int
    """From 1 on."""
    iterations: int
    """How many there will be at most."""
    T_camera_object: Array
    """(4, 4), the best pose so far."""
    confidence: float
    """Of that pose, in [0, 1]."""
    particles: Array
    """(N, 4, 4), the hypotheses alive, best first where they are ranked."""
    estimate: Estimate | None = None
    """The result, in the last step only."""
