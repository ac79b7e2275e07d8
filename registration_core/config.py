"""The constants of a snap that can be set, in small nested records with a default for each."""

from dataclasses import dataclass, field
from typing import Any, Literal, Self

from registration_core.config_values import merged, plain
from registration_core.fitted import FITTED


@dataclass(frozen=True)
class ObservationConfig:
    """How the depth image around the start is read."""

    reach: float = 0.17
    """How far beyond the object at the start a snap looks, metres."""
    pixels_across: int = 30
    """The image is reduced (by 2 or 4) as long as the object's diameter still spans this many pixels."""
    depth_gap: float = 0.015
    """Neighbouring pixels farther apart than this lie on different surfaces, metres."""
    normal_radius: int = 2
    """Normals are fitted to (2r + 1)^2 pixels."""
    plane_tolerance: float = 0.008
    """Pixels closer than this to the supporting plane belong to it, metres."""
    plane_share: float = 0.15
    """A plane counts as one only if it holds this share of the pixels, ..."""
    plane_excess: float = 1.5
    """... and this many times the object's silhouette: in a masked image a flat side of it is no support."""
    plane_weight: float = 0.1
    """What a plane pixel weighs, 1 for the others: not 0, for a flat object lies in its plane."""
    plane_trials: int = 60
    """RANSAC hypotheses."""
    min_pixels: int = 40
    """With fewer measured pixels about the object there is nothing to register to."""


@dataclass(frozen=True)
class SpreadConfig:
    """How far off the start may be, and how far the search goes."""

    translation: float = 0.04
    """Where the caller does not say, metres."""
    rotation: float = 0.5
    """Where the caller does not say, radians."""
    search: float = 1.4
    """Proposals are drawn this many times wider than that."""
    belief: float = 0.5
    """Where the caller does not say, the prior about the start is this much narrower: it may well be good."""


@dataclass(frozen=True)
class ProposalConfig:
    """The poses that a snap starts from."""

    count: int = 14_000
    """Drawn where the start may be far off."""
    least_share: float = 0.25
    """Share of them drawn where the caller says that it is close."""
    gaussian_share: float = 0.1
    """Share drawn from the Gaussian about the start alone."""
    ray_share: float = 0.1
    """Share then shifted along the viewing ray onto the observed surface; the rest is also turned onto it."""
    scales: tuple[float, ...] = (0.3, 0.7, 1.0, 1.5)
    """Multiples of the spread that are cycled through."""
    max_shift: float = 0.15
    """A point is put on observed depth only if it is no farther off, metres."""
    max_turn: float = 2.0
    """A normal is turned onto the observed one only if the angle is smaller, radians."""
    tries: int = 4
    """Draws until a point falls on a measured pixel off the plane."""


@dataclass(frozen=True)
class AgreementConfig:
    """Weights of the sparse agreement (agreement.py)."""

    free: float = 0.9
    """Of surface claimed where the sensor saw through."""
    missing: float = 0.05
    """Of surface claimed where there is no measurement."""
    ring: float = 0.7
    """Of observed surface that goes on beyond the silhouette."""
    clear: float = 0.3
    """Reward of a silhouette before a background that lies farther."""
    area: float = 0.6
    """How much a view that shows more of the object counts more."""
    prior: float = 0.03
    """Of the heavy-tailed prior about the start."""
    wide_softening: float = 1.0
    """Factor on `free` and `ring` in the first stage, where no hypothesis is exact yet."""


@dataclass(frozen=True)
class StageConfig:
    """One stage of the annealing: keep distinct modes, polish them, weigh them anew."""

    modes: int
    """Distinct hypotheses that go on to this stage."""
    niche_translation: float
    """Modes are distinct if they are farther apart than this, metres, ..."""
    niche_rotation: float
    """... or than this, radians."""
    iterations: int
    """Gauss-Newton steps."""
    tukey_start: float
    """Width of the robust kernel in the first step, metres."""
    tukey_end: float
    """Width of the robust kernel in the last step, metres."""
    points: int
    """Surface points in the polish and in the weight after it."""
    epsilon: float
    """Distance at which agreement ends, metres."""


@dataclass(frozen=True)
class SelectionConfig:
    """How the winner is chosen (selection.py): evidence in pixels over the mean silhouette area."""

    prior: float = FITTED.prior
    """Weight of the heavy-tailed prior about the start."""
    lead: float = 1.0
    """The polished start replaces the start, and another mode replaces that, only if it scores better by this
    much, ..."""
    lead_over_fit: float = 2.0
    """... or by this much where the start itself fits, ..."""
    fit_match: float = 0.7
    """... which it does where more of the claimed surface than this is matched, ..."""
    aside_translation: float = 0.004
    """... and the pose is farther from it than this, metres, ..."""
    aside_rotation: float = 0.07
    """... or this, radians."""
    min_match: float = 0.04
    """With less of the claimed surface matched than this, the start is kept."""
    match_share: float = FITTED.match_share
    """Weight of the share of the claimed surface that was measured where it is claimed."""
    classes: tuple[float, ...] = FITTED.classes
    """Weights of the classes of pixels, in the order of `evidence.class_names()`."""


@dataclass(frozen=True)
class ConfidenceConfig:
    """Calibration of the confidence (confidence.py)."""

    temperature: float = FITTED.temperature
    """Of the softmax that shares the belief among the modes."""
    mode_radius: float = 0.07
    """Hypotheses closer than this share of the diameter are one mode."""
    weights: tuple[float, ...] = FITTED.confidence
    """Logistic weights of what speaks for the winner, in the order of `confidence.FEATURES`."""


@dataclass(frozen=True)
class ParticleFilterConfig:
    """The filter of the paper, which leaves the spread and the noise open."""

    particles: int = 625
    iterations: int = 640
    epsilon: float = 0.01
    """Eq. 3, metres."""
    alpha: float = 0.5
    """Eq. 5, weight of the share of observed points that are explained."""
    beta: float = 0.5
    """Eq. 5, weight of the share of rendered points that agree."""
    noise_translation: float = 0.002
    """Standard deviation added to each axis after resampling, metres."""
    noise_rotation: float = 0.02
    """The same for the rotation vector, radians."""
    silhouette_pixels: int = 600
    """Every k-th column and row is used, as long as the mean silhouette still covers this many pixels."""


ANYWHERE_STAGES = (
    StageConfig(3000, 0.015, 0.25, 6, 0.03, 0.010, 96, 0.010),
    StageConfig(400, 0.008, 0.12, 6, 0.012, 0.005, 160, 0.006),
    StageConfig(100, 0.003, 0.05, 4, 0.006, 0.004, 256, 0.006),
)


@dataclass(frozen=True)
class AnywhereConfig:
    """The search without a start (global_search.py)."""

    count: int = 600_000
    """Proposals."""
    kept: int = 30_000
    """Proposals of which the distinct modes are taken."""
    stages: tuple[StageConfig, ...] = ANYWHERE_STAGES


DEFAULT_STAGES = (
    StageConfig(1500, 0.015, 0.25, 4, 0.03, 0.012, 64, 0.010),
    StageConfig(400, 0.008, 0.12, 6, 0.012, 0.005, 160, 0.006),
    StageConfig(160, 0.003, 0.05, 4, 0.006, 0.004, 256, 0.006),
)


@dataclass(frozen=True)
class RoundConfig:
    """One search for the object about the start."""

    share: float
    """Of all proposals that are drawn, and of all modes that are kept."""
    widening: float
    """Proposals are drawn this many times wider than the search is said to go."""
    doubt: float
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

    method: Literal["viewpoint", "particle_filter"] = "viewpoint"
    """Sparse viewpoint model with polished modes, or the paper's particle filter on rendered depth."""
    observation: ObservationConfig = field(default_factory=ObservationConfig)
    spread: SpreadConfig = field(default_factory=SpreadConfig)
    proposals: ProposalConfig = field(default_factory=ProposalConfig)
    wide_points: int = 40
    """Surface points of a proposal that are looked up."""
    wide_epsilon: float = 0.02
    """Distance at which agreement of a proposal ends, metres."""
    wide_kept: int = 5000
    """Proposals of which the distinct modes are taken."""
    agreement: AgreementConfig = field(default_factory=AgreementConfig)
    stages: tuple[StageConfig, ...] = DEFAULT_STAGES
    rounds: tuple[RoundConfig, ...] = DEFAULT_ROUNDS
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
        return plain(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> "SnapConfig":
        """The configuration whose fields are `values` over the defaults, or over `{"preset": "paper"}`.

        Raises:
            ValueError: naming the field that is unknown or of the wrong type.
        """
        if not isinstance(values, dict):
            raise ValueError("config must be an object of named fields")
        values = dict(values)
        presets = {"default": SnapConfig(), "paper": SnapConfig.paper()}
        preset = values.pop("preset", "default")
        if not isinstance(preset, str) or preset not in presets:
            raise ValueError(f"config.preset must be one of {', '.join(presets)}; it is {preset!r}")
        return merged(presets[preset], values, "config")
