"""Whether an object is found without any start: `propose` on real frames."""

import time
from collections.abc import Sequence
from concurrent.futures import Executor

import numpy as np

from benchmarks.figures import Figure, Target, percentile
from benchmarks.registration.instances import Instance
from benchmarks.registration.judging import Judge
from benchmarks.registration.methods import polished_truth, warmed_up
from registration_core import propose
from registration_core.rendering.rasterizer import render_depth

FOUND, SECONDS = Target(95.0, at_least=True), Target(1.0)
FIRST = 5
"""Hypotheses among which a right one counts as found."""
MARGIN = 40
"""Pixels about the object that a person who draws a region leaves."""


def proposal_figures(pool: Executor, instances: Sequence[Instance], searches: int) -> list[Figure]:
    """Shares found and seconds, in whole images and in regions as a person draws them.

    Args:
        pool: which has nothing else to do.
        searches: over all instances; each has at least one.
    """
    if not instances:
        return []
    seeds = max(1, searches // len(instances))
    return pool.submit(_figures, instances, seeds).result()


def _figures(instances: Sequence[Instance], seeds: int) -> list[Figure]:
    warmed_up()
    figures = []
    for where in ("whole image", "region"):
        found, seconds = [], []
        for instance in instances:
            polished_truth(instance)  # builds the viewpoint model
            region = _region(instance) if where == "region" else None
            judge = Judge(instance.model)
            for seed in range(seeds):
                began = time.perf_counter()
                hypotheses = propose(
                    instance.model, instance.depth, instance.camera, region, rng=np.random.default_rng(seed)
                )
                seconds.append(time.perf_counter() - began)
                errors = [judge.nearest_error(h.T_camera_object, instance.truths) for h in hypotheses[:FIRST]]
                found.append(any(error.is_right for error in errors))
        name = f"{instances[0].set_name}, a right pose among the first {FIRST} proposals, {where}"
        figures.append(Figure(name, 100.0 * float(np.mean(found)), "%", FOUND))
        figures.append(Figure(f"seconds of that, p95, {where}", percentile(seconds, 95), "s", SECONDS))
    return figures


def _region(instance: Instance) -> tuple[int, int, int, int]:
    """(left, top, width, height) of the object with a margin."""
    rows, columns = np.nonzero(render_depth(instance.model, instance.camera, instance.truth))
    left, top = max(0, int(columns.min()) - MARGIN), max(0, int(rows.min()) - MARGIN)
    return left, top, int(columns.max()) + MARGIN - left, int(rows.max()) + MARGIN - top
