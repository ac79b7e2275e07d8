"""What each part of the default snap is worth: it is left out, everything else stays."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.figures import Figure, percentile
from benchmarks.registration.instances import HALF, HIDDEN, Instance, synthetic_instances
from benchmarks.registration.judging import Judge
from benchmarks.registration.starts import FAR, MIDDLE, Shell, starts
from registration_core import SnapConfig, snap, warm_up
from registration_core.config import RoundConfig, StageConfig
from registration_core.judge.pixel_evidence import BELOW, RING

TITLE = "Ablation: ADD(-S) < 10 % on synthetic scenes, from 5 cm/30° and 10 cm/60° together"

AN_OBJECT, STARTS = 3, 2
"""Instances of each object in each set; starts from each shell about each instance."""
QUICK_SCENES, QUICK_VARIANTS = 3, 2
"""Scenes of each set, one instance of which makes a quick run, and how many of the variants then."""

DEFAULT = SnapConfig()
EVERYWHERE = 1.0
"""A share of the pixels that no plane has."""


@dataclass(frozen=True)
class Variant:
    """The default with something changed."""

    name: str
    config: SnapConfig
    is_told: bool = False
    """Whether a snap is told how far off its start is."""


def variants() -> list[Variant]:
    """The default first."""
    proposals, agreement = DEFAULT.proposals, DEFAULT.agreement
    selection, observation = DEFAULT.selection, DEFAULT.observation
    without_prior = replace(selection, prior=0.0), replace(agreement, prior=0.0)
    no_rings = (*selection.classes[:RING], *(0.0,) * (BELOW - RING), *selection.classes[BELOW:])
    under_it = (*selection.classes[:BELOW], 0.0, *selection.classes[BELOW + 1 :])
    return [
        Variant("the default", DEFAULT),
        Variant("spread of the start told", DEFAULT, is_told=True),
        Variant("the first round only", replace(DEFAULT, rounds=DEFAULT.rounds[:1])),
        Variant("the first two rounds", replace(DEFAULT, rounds=DEFAULT.rounds[:2])),
        Variant("all rounds, however sure", replace(DEFAULT, rounds=tuple(map(always, DEFAULT.rounds)))),
        Variant("no round wider", replace(DEFAULT, rounds=tuple(map(no_wider, DEFAULT.rounds)))),
        Variant("half of the proposals", replace(DEFAULT, proposals=replace(proposals, count=7_000))),
        Variant("twice the proposals", replace(DEFAULT, proposals=replace(proposals, count=28_000))),
        Variant(
            "Gaussian proposals only",
            replace(DEFAULT, proposals=replace(proposals, gaussian_share=1.0, ray_share=0.0)),
        ),
        Variant("a third of the modes", replace(DEFAULT, stages=tuple(map(fewer_modes, DEFAULT.stages)))),
        Variant(
            "one Gauss-Newton step a stage", replace(DEFAULT, stages=tuple(map(one_step, DEFAULT.stages)))
        ),
        Variant("seeing through costs nothing", replace(DEFAULT, agreement=replace(agreement, free=0.0))),
        Variant(
            "surface that goes on costs nothing",
            replace(DEFAULT, agreement=replace(agreement, ring=0.0, clear=0.0)),
        ),
        Variant(
            "no supporting plane",
            replace(DEFAULT, observation=replace(observation, plane_share=EVERYWHERE)),
        ),
        Variant(
            "no prior about the start",
            replace(DEFAULT, selection=without_prior[0], agreement=without_prior[1]),
        ),
        Variant(
            "no evidence beyond the outline",
            replace(DEFAULT, selection=replace(selection, classes=no_rings)),
        ),
        Variant(
            "nothing lost below the plane", replace(DEFAULT, selection=replace(selection, classes=under_it))
        ),
        Variant(
            "no lead demanded", replace(DEFAULT, selection=replace(selection, lead=0.0, lead_over_fit=0.0))
        ),
    ]


def always(one: RoundConfig) -> RoundConfig:
    """Never left out."""
    return replace(one, doubt=1.0)


def no_wider(one: RoundConfig) -> RoundConfig:
    """As wide as the first."""
    return replace(one, widening=1.0)


def fewer_modes(stage: StageConfig) -> StageConfig:
    """A third of them."""
    return replace(stage, modes=stage.modes // 3)


def one_step(stage: StageConfig) -> StageConfig:
    """A single one, with the kernel's last width."""
    return replace(stage, iterations=1, tukey_start=stage.tukey_end)


def run(folder: Path, quick: bool) -> list[Figure]:
    """Successes and milliseconds of every variant, from the same starts."""
    warm_up()
    sets = {name: _instances(name, quick) for name in (HALF, HIDDEN)}
    figures = []
    for variant in variants()[: QUICK_VARIANTS if quick else None]:
        seconds: list[float] = []
        for name, instances in sets.items():
            rights = [
                right
                for instance in instances
                for right in _rights(variant, instance, (MIDDLE, FAR), seconds)
            ]
            figures.append(Figure(f"{variant.name}: {name}", 100.0 * float(np.mean(rights)), "%"))
        figures.append(Figure(f"{variant.name}: median", 1e3 * percentile(seconds, 50), "ms"))
    return figures


def _instances(set_name: str, quick: bool) -> list[Instance]:
    if quick:
        return synthetic_instances(set_name, 1, QUICK_SCENES)[:1]
    return synthetic_instances(set_name, AN_OBJECT)


def _rights(
    variant: Variant, instance: Instance, shells: Sequence[Shell], seconds: list[float]
) -> list[bool]:
    judge = Judge(instance.model)
    found = []
    for shell in shells:
        poses = starts(instance.truth, instance.model, instance.camera, shell, STARTS, instance.seed)
        for number, T_start in enumerate(poses):
            began = time.perf_counter()
            estimate = snap(
                instance.model, instance.depth, instance.camera, T_start, variant.config,
                np.random.default_rng(number),
                (shell.translation, shell.rotation) if variant.is_told else None,
            )  # fmt: skip
            seconds.append(time.perf_counter() - began)
            found.append(judge.error(estimate.T_camera_object, instance.truth).is_right)
    return found
