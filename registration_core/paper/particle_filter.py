"""A particle filter over poses, as in Ye et al., "Human-in-the-loop Pose Estimation via Shared Autonomy"
(IUI 2021).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from registration_core.paper.likelihood import Likelihood
from registration_core.paper.resampling import normalised, systematic

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Noise:
    """Standard deviations of a Gaussian over poses, for each axis."""

    translation: float
    """Metres, along camera axes."""
    rotation: float
    """Radians, rotation vector in camera axes about the frame's origin."""


@dataclass(frozen=True, eq=False)
class Particles:
    """Weighted pose hypotheses."""

    poses: Array
    """(N, 4, 4)."""
    log_weights: Array
    """(N,), up to a common constant."""


def spread(poses: Array, noise: Noise, rng: np.random.Generator) -> Array:
    """Poses (N, 4, 4), each moved by Gaussian noise."""
    moved = poses.copy()
    moved[:, :3, 3] += rng.normal(scale=noise.translation, size=(len(poses), 3))
    turns = Rotation.from_rotvec(rng.normal(scale=noise.rotation, size=(len(poses), 3)))
    moved[:, :3, :3] = turns.as_matrix() @ poses[:, :3, :3]
    return moved


def initial_poses(start: Array, noise: Noise, count: int, rng: np.random.Generator) -> Array:
    """Poses (count, 4, 4) from a Gaussian about the operator's pose (4, 4), which is the first of them."""
    poses = np.tile(start, (count, 1, 1))
    poses[1:] = spread(poses[1:], noise, rng)
    return poses


class ParticleFilter:
    """Importance resampling in each iteration, then Gaussian noise, then new weights."""

    def __init__(self, likelihood: Likelihood, noise: Noise, poses: Array, rng: np.random.Generator) -> None:
        """Weigh the initial hypotheses (N, 4, 4)."""
        self._likelihood = likelihood
        self._noise = noise
        self._rng = rng
        self.particles = Particles(poses, likelihood(poses))

    def step(self) -> Particles:
        """One iteration."""
        weights = normalised(self.particles.log_weights)
        chosen = self.particles.poses[systematic(weights, self._rng)]
        poses = spread(chosen, self._noise, self._rng)
        self.particles = Particles(poses, self._likelihood(poses))
        return self.particles
