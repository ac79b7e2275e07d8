"""One pose against several views: `snap_views` on the turning bunny."""

from collections.abc import Sequence

import numpy as np

from benchmarks.figures import Figure, Target
from benchmarks.registration.instances import BUNNY, Instance, real_instances
from benchmarks.registration.judging import Judge
from benchmarks.registration.starts import FARTHEST, starts
from benchmarks.registration.trials import single_threaded_pool
from registration_core import pose, snap_views

EXACT = Target(99.0, at_least=True)
VIEWS = 4
"""90 degrees apart on the turntable."""


def view_figures(starts_a_group: int) -> list[Figure]:
    """The share of starts from which the MSSD ends below 5 %; none without the data."""
    instances = real_instances(BUNNY)
    if not instances:
        return []
    apart = len(instances) // VIEWS
    groups = [instances[first::apart] for first in range(apart)]
    with single_threaded_pool(1) as pool:
        exact = [flag for flags in pool.map(_exact, groups, [starts_a_group] * apart) for flag in flags]
    name = f"{BUNNY}, {VIEWS} views, MSSD < 5 %, from {FARTHEST}"
    return [Figure(name, 100.0 * float(np.mean(exact)), "%", EXACT)]


def _exact(group: Sequence[Instance], count: int) -> list[bool]:
    """Of starts about the object as its first view shows it."""
    first = group[0]
    judge = Judge(first.model)
    views = [(one.depth, one.camera, one.T_world_camera) for one in group]
    truth = pose.mean(np.array([one.T_world_camera @ one.truth for one in group]))
    flags = []
    for n, T_start in enumerate(starts(first.truth, first.model, first.camera, FARTHEST, count, first.seed)):
        T_world_object = pose.orthonormalised(first.T_world_camera @ T_start)
        estimate = snap_views(first.model, views, T_world_object, rng=np.random.default_rng(n))
        flags.append(judge.error(estimate.T_world_object, truth).is_exact)
    return flags
