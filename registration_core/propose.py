"""Likely poses of an object anywhere in a depth image, without a human start."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from registration_core.config import SnapConfig
from registration_core.estimate import Hypothesis
from registration_core.geometry.camera import Intrinsics
from registration_core.geometry.kernels import to_rows
from registration_core.search.observation import FARTHEST, observe_region
from registration_core.search.proposals import anywhere
from registration_core.search.snap_input import SnapInput, checked_depth
from registration_core.search.sparse_score import Prior, surface_of
from registration_core.search.viewpoint_model import Registrable, viewpoint_model
from registration_core.seeding import seed_of
from registration_core.verdict import found_anywhere
from registration_core.view_search import ViewSearch, ranked

MOST = 10
"""Hypotheses that are returned, at most."""

NO_PRIOR = np.float32(1e6)
"""Metres and radians: so wide a spread that every pose is as good a guess as any other."""


def propose(
    model: Registrable,
    depth: ArrayLike,
    camera: Intrinsics,
    region: tuple[int, int, int, int] | None = None,
    config: SnapConfig | None = None,
    rng: np.random.Generator | None = None,
) -> tuple[Hypothesis, ...]:
    """Likely poses of an object in a depth image, best first; none where there is nothing to go by.

    Points of the model are put onto observed ones, normal on normal, and turned about them at random; the
    best of many are annealed and polished as in a snap, and judged by the same evidence.

    Args:
        depth: (H, W), metres, 0 = no measurement.
        region: (left, top, width, height) in pixels, where to look; the whole image where it is None.
        config: `SnapConfig()` where it is None.
        rng: the source of all randomness; fresh entropy where it is None.

    Raises:
        ValueError: naming the argument that is wrong, and how.
    """
    config = SnapConfig() if config is None else config
    image = checked_depth(depth, camera)
    left, top, right, bottom = checked_region(region, camera)
    known = viewpoint_model(model)
    rng = np.random.default_rng(seed_of(rng))
    part = image[top:bottom, left:right]
    measured = part[(part > 0) & (part < FARTHEST)]
    if not len(measured):
        return ()
    distance = float(np.median(measured))
    observation = observe_region(
        image, camera, (left, top, right, bottom), distance, known, config.observation, rng
    )
    surface = surface_of(known)
    poses = anywhere(surface, observation.grid, config.anywhere.count, rng)
    if not len(poses):
        return ()
    start = np.eye(4)
    start[2, 3] = distance
    prior = Prior(to_rows(start)[0], NO_PRIOR, NO_PRIOR)
    problem = SnapInput(known, image, camera, start, start, prior, prior, config)
    search = ViewSearch(problem, observation, surface, rng)
    found, agreement = ranked(poses, search.weighed(poses), config.anywhere.kept)
    for stage in config.anywhere.stages:
        found, agreement = search.refined(found, agreement, stage)
    return found_anywhere(search, found, MOST)


def checked_region(region: Sequence[int] | None, camera: Intrinsics) -> tuple[int, int, int, int]:
    """(left, top, right, bottom) of a region (left, top, width, height), cut to the image.

    Raises:
        ValueError: where it is no rectangle of whole pixels, or lies outside the image.
    """
    if region is None:
        return 0, 0, camera.width, camera.height
    values = np.asarray(region)
    if values.shape != (4,) or values.dtype.kind not in "iu" or (values[2:] < 1).any():
        raise ValueError(f"region must be (left, top, width, height) in whole pixels; it is {region!r}")
    left, top, width, height = values.tolist()
    right, bottom = min(left + width, camera.width), min(top + height, camera.height)
    left, top = max(left, 0), max(top, 0)
    if left >= right or top >= bottom:
        raise ValueError(
            f"region must overlap the image of {camera.width} x {camera.height}; it is {region!r}"
        )
    return left, top, right, bottom
