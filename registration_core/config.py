"""The constants of a snap that can be set, in small nested records with a default for each."""

import reprlib
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, Self, get_args

import msgspec

from registration_core.config_values import (
    Count,
    Items,
    NotNegative,
    Number,
    Positive,
    as_many_as,
    at_most,
    converted,
    overlaid,
)
from registration_core.fitted import FITTED

Method = Literal["viewpoint", "particle_filter"]


@dataclass(frozen=True)
class ObservationConfig:
    """How the depth image around the start is read."""

    reach: NotNegative = 0.17
    """How far beyond the object at the start a snap looks, metres."""
    pixels_across: Count = 30
    """The image is reduced (by 2 or 4) as long as the object's diameter still spans this many pixels."""
    depth_gap: Positive = 0.015
    """Neighbouring pixels farther apart than this lie on different surfaces, metres."""
    normal_radius: Annotated[int, at_most(16)] = 2
    """Normals are fitted to (2r + 1)^2 pixels."""
    plane_tolerance: Positive = 0.008
    """Pixels closer than this to the supporting plane belong to it, metres."""
    plane_share: Number = 0.15
    """A plane counts as one only if it holds this share of the pixels, ..."""
    plane_excess: Number = 1.5
    """... and this many times the object's silhouette: in a masked image a flat side of it is no support."""
    plane_weight: NotNegative = 0.1
    """What a plane pixel weighs, 1 for the others: not 0, for a flat object lies in its plane."""
    plane_trials: Annotated[int, at_most(10_000)] = 60
    """RANSAC hypotheses."""
    min_pixels: Count = 40
    """With fewer measured pixels about the object there is nothing to register to."""


@dataclass(frozen=True)
class SpreadConfig:
    """How far off the start may be, and how far the search goes."""

    translation: Positive = 0.04
    """Where the caller does not say, metres."""
    rotation: Positive = 0.5
    """Where the caller does not say, radians."""
    search: Positive = 1.4
    """Proposals are drawn this many times wider than that."""
    belief: Positive = 0.5
    """Where the caller does not say, the prior about the start is this much narrower: it may well be good."""


@dataclass(frozen=True)
class ProposalConfig:
    """The poses that a snap starts from."""

    count: Count = 14_000
    """Drawn where the start may be far off."""
    least_share: NotNegative = 0.25
    """Share of them drawn where the caller says that it is close."""
    gaussian_share: NotNegative = 0.1
    """Share drawn from the Gaussian about the start alone."""
    ray_share: NotNegative = 0.1
    """Share then shifted along the viewing ray onto the observed surface; the rest is also turned onto it."""
    scales: Items[NotNegative] = (0.3, 0.7, 1.0, 1.5)
    """Multiples of the spread that are cycled through."""
    max_shift: Positive = 0.15
    """A point is put on observed depth only if it is no farther off, metres."""
    max_turn: Positive = 2.0
    """A normal is turned onto the observed one only if the angle is smaller, radians."""
    tries: Annotated[int, at_most(64)] = 4
    """Draws until a point falls on a measured pixel off the plane."""


@dataclass(frozen=True)
class AgreementConfig:
    """Weights of the sparse agreement (agreement.py)."""

    free: Number = 0.9
    """Of surface claimed where the sensor saw through."""
    missing: Number = 0.05
    """Of surface claimed where there is no measurement."""
    ring: Number = 0.7
    """Of observed surface that goes on beyond the silhouette."""
    clear: Number = 0.3
    """Reward of a silhouette before a background that lies farther."""
    area: Number = 0.6
    """How much a view that shows more of the object counts more."""
    prior: Number = 0.03
    """Of the heavy-tailed prior about the start."""
    wide_softening: Number = 1.0
    """Factor on `free` and `ring` in the first stage, where no hypothesis is exact yet."""


@dataclass(frozen=True)
class StageConfig:
    """One stage of the annealing: keep distinct modes, polish them, weigh them anew."""

    modes: Annotated[int, at_most(5_000)]
    """Distinct hypotheses that go on to this stage."""
    niche_translation: Positive
    """Modes are distinct if they are farther apart than this, metres, ..."""
    niche_rotation: Positive
    """... or than this, radians."""
    iterations: Annotated[int, at_most(10_000)]
    """Gauss-Newton steps."""
    tukey_start: Positive
    """Width of the robust kernel in the first step, metres."""
    tukey_end: Positive
    """Width of the robust kernel in the last step, metres."""
    points: Count
    """Surface points in the polish and in the weight after it."""
    epsilon: Positive
    """Distance at which agreement ends, metres."""


@dataclass(frozen=True)
class SelectionConfig:
    """How the winner is chosen (selection.py): evidence in pixels over the mean silhouette area."""

    prior: Number = FITTED.prior
    """Weight of the heavy-tailed prior about the start."""
    lead: Number = 1.0
    """The polished start replaces the start, and another mode replaces that, only if it scores better by this
    much, ..."""
    lead_over_fit: Number = 2.0
    """... or by this much where the start itself fits, ..."""
    fit_match: Number = 0.7
    """... which it does where more of the claimed surface than this is matched, ..."""
    aside_translation: Number = 0.004
    """... and the pose is farther from it than this, metres, ..."""
    aside_rotation: Number = 0.07
    """... or this, radians."""
    min_match: Number = 0.04
    """With less of the claimed surface matched than this, the start is kept."""
    match_share: Number = FITTED.match_share
    """Weight of the share of the claimed surface that was measured where it is claimed."""
    classes: Annotated[tuple[Number, ...], as_many_as(FITTED.classes)] = FITTED.classes
    """Weights of the classes of pixels, in the order of `evidence.class_names()`."""


@dataclass(frozen=True)
class ConfidenceConfig:
    """Calibration of the confidence (confidence.py)."""

    temperature: Positive = FITTED.temperature
    """Of the softmax that shares the belief among the modes."""
    mode_radius: Positive = 0.07
    """Hypotheses closer than this share of the diameter are one mode."""
    weights: Annotated[tuple[Number, ...], as_many_as(FITTED.confidence)] = FITTED.confidence
    """Logistic weights of what speaks for the winner, in the order of `confidence.FEATURES`."""


@dataclass(frozen=True)
class ParticleFilterConfig:
    """The filter of the paper, which leaves the spread and the noise open."""

    particles: Count = 625
    iterations: Annotated[int, at_most(10_000)] = 640
    epsilon: Positive = 0.01
    """Eq. 3, metres."""
    alpha: NotNegative = 0.5
    """Eq. 5, weight of the share of observed points that are explained."""
    beta: NotNegative = 0.5
    """Eq. 5, weight of the share of rendered points that agree."""
    noise_translation: NotNegative = 0.002
    """Standard deviation added to each axis after resampling, metres."""
    noise_rotation: NotNegative = 0.02
    """The same for the rotation vector, radians."""
    silhouette_pixels: Count = 600
    """Every k-th column and row is used, as long as the mean silhouette still covers this many pixels."""


ANYWHERE_STAGES = (
    StageConfig(3000, 0.015, 0.25, 6, 0.03, 0.010, 96, 0.010),
    StageConfig(400, 0.008, 0.12, 6, 0.012, 0.005, 160, 0.006),
    StageConfig(100, 0.003, 0.05, 4, 0.006, 0.004, 256, 0.006),
)


@dataclass(frozen=True)
class AnywhereConfig:
    """The search without a start (global_search.py)."""

    count: Count = 600_000
    """Proposals."""
    kept: Count = 30_000
    """Proposals of which the distinct modes are taken."""
    stages: Items[StageConfig] = ANYWHERE_STAGES


DEFAULT_STAGES = (
    StageConfig(1500, 0.015, 0.25, 4, 0.03, 0.012, 64, 0.010),
    StageConfig(400, 0.008, 0.12, 6, 0.012, 0.005, 160, 0.006),
    StageConfig(160, 0.003, 0.05, 4, 0.006, 0.004, 256, 0.006),
)


@dataclass(frozen=True)
class RoundConfig:
    """One search for the object about the start."""

    share: NotNegative
    """Of all proposals that are drawn, and of all modes that are kept."""
    widening: Positive
    """Proposals are drawn this many times wider than the search is said to go."""
    doubt: NotNegative
    """The round is left out where the confidence so far is higher than this."""


ROUNDS = ((0.4, 1.1), (0.5, 1.4), (0.8, 1.6))
"""Share and widening of each; from which confidence on one is left out is fitted, and where it is not, none
is."""
ALWAYS = 1
"""Of them, the first so many are never left out: how sure a pose is cannot be told before rivals were looked
for."""
DEFAULT_ROUNDS = tuple(
    RoundConfig(share, widening, doubt)
    for (share, widening), doubt in zip(ROUNDS, (*FITTED.doubts, *[1.0] * len(ROUNDS)), strict=False)
)


@dataclass(frozen=True)
class SnapConfig:
    """All constants of a snap that can be set; the defaults are the fast method."""

    method: Method = "viewpoint"
    """Sparse viewpoint model with polished modes, or the paper's particle filter on rendered depth."""
    observation: ObservationConfig = field(default_factory=ObservationConfig)
    spread: SpreadConfig = field(default_factory=SpreadConfig)
    proposals: ProposalConfig = field(default_factory=ProposalConfig)
    wide_points: Count = 40
    """Surface points of a proposal that are looked up."""
    wide_epsilon: Positive = 0.02
    """Distance at which agreement of a proposal ends, metres."""
    wide_kept: Count = 5000
    """Proposals of which the distinct modes are taken."""
    agreement: AgreementConfig = field(default_factory=AgreementConfig)
    stages: Items[StageConfig] = DEFAULT_STAGES
    rounds: Items[RoundConfig] = DEFAULT_ROUNDS
    """Searched one after the other, as far as the confidence asks for it."""
    anywhere: AnywhereConfig = field(default_factory=AnywhereConfig)
    selection: SelectionConfig = field(default_factory=SelectionConfig)
    confidence: ConfidenceConfig = field(default_factory=ConfidenceConfig)
    particle_filter: ParticleFilterConfig = field(default_factory=ParticleFilterConfig)

    @classmethod
    def paper(cls) -> Self:
        """The method of Ye et al. (IUI 2021): 625 particles, 640 iterations, rendered depth, Eq. 3 to 5."""
        return cls(method="particle_filter")

    def to_dict(self) -> dict[str, Any]:
        """All fields as JSON values."""
        return msgspec.json.decode(msgspec.json.encode(self))

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> "SnapConfig":
        """The configuration whose fields are `values` over the defaults, or over `{"preset": "paper"}`.

        Raises:
            ValueError: naming the field that is unknown, of the wrong type or out of its bounds.
        """
        if not isinstance(values, dict):
            raise ValueError("config must be an object of named fields")
        presets = {"default": SnapConfig(), "paper": SnapConfig.paper()}
        preset = values.get("preset", "default")
        _check_choice(preset, tuple(presets), "config.preset")
        fields = {key: value for key, value in values.items() if key != "preset"}
        overlay = overlaid(presets[preset].to_dict(), fields, "config")
        _check_choice(overlay["method"], get_args(Method), "config.method")
        return converted(overlay, SnapConfig, "config")


def _check_choice(value: Any, choices: tuple[str, ...], name: str) -> None:
    if value not in choices:
        raise ValueError(f"{name} must be one of {', '.join(choices)}; it is {reprlib.repr(value)}")
