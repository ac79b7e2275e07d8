"""The filter on a likelihood whose answer is known."""

import numpy as np
from numpy.typing import NDArray

from registration_core.geometry import pose
from registration_core.paper.particle_filter import Noise, ParticleFilter, initial_poses, spread

TARGET = pose.exp([0.03, -0.02, 0.5, 0.2, 0.0, -0.1])


def bell(T_camera_centre: NDArray[np.float64]) -> NDArray[np.float64]:
    """Log-density of a Gaussian about TARGET, 5 mm and 0.05 rad wide."""
    twists = np.stack([pose.log(pose.inverse(TARGET) @ T) for T in T_camera_centre])
    return -0.5 * ((twists / [0.005, 0.005, 0.005, 0.05, 0.05, 0.05]) ** 2).sum(axis=1)


def test_initial_poses_are_gaussian_about_the_start() -> None:
    poses = initial_poses(TARGET, Noise(0.02, 0.1), 4000, np.random.default_rng(0))
    np.testing.assert_array_equal(poses[0], TARGET)
    np.testing.assert_allclose(poses[:, :3, 3].std(axis=0), 0.02, rtol=0.1)
    np.testing.assert_allclose(poses[:, :3, 3].mean(axis=0), TARGET[:3, 3], atol=0.002)
    turns = np.array([pose.log(T @ pose.inverse(TARGET))[3:] for T in poses])
    np.testing.assert_allclose(turns.std(axis=0), 0.1, rtol=0.1)


def test_no_noise_moves_nothing() -> None:
    poses = np.tile(TARGET, (5, 1, 1))
    np.testing.assert_allclose(spread(poses, Noise(0.0, 0.0), np.random.default_rng(0)), poses, atol=1e-15)


def test_filter_finds_the_peak() -> None:
    rng = np.random.default_rng(1)
    start = pose.perturbed(TARGET, 0.03, 0.3, rng)
    poses = initial_poses(start, Noise(0.02, 0.2), 500, rng)
    particle_filter = ParticleFilter(bell, Noise(0.001, 0.01), poses, rng)
    for _ in range(15):
        particles = particle_filter.step()
    apart = pose.distance(particles.poses[particles.log_weights.argmax()], TARGET)
    assert apart.translation < 0.003
    assert apart.rotation < 0.05
    assert particles.poses.shape == (500, 4, 4)


def test_filter_without_any_evidence_keeps_its_particles_alive() -> None:
    poses = np.tile(TARGET, (10, 1, 1))
    nothing = lambda T_camera_centre: np.full(len(T_camera_centre), -np.inf)  # noqa: E731
    particle_filter = ParticleFilter(nothing, Noise(0.0, 0.0), poses, np.random.default_rng(0))
    np.testing.assert_allclose(particle_filter.step().poses, poses, atol=1e-15)


def test_filter_repeats_itself_with_the_same_seed() -> None:
    def run() -> NDArray[np.float64]:
        rng = np.random.default_rng(3)
        start = initial_poses(TARGET, Noise(0.02, 0.2), 50, rng)
        particle_filter = ParticleFilter(bell, Noise(0.001, 0.01), start, rng)
        return particle_filter.step().poses

    np.testing.assert_array_equal(run(), run())
