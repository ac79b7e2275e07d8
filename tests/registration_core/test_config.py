"""Configurations to JSON and back, and what is refused."""

import json

import pytest

from registration_core import SnapConfig
from registration_core.config import RoundConfig
from registration_core.judge.confidence import FEATURES

ONE_ROUND = SnapConfig(rounds=(RoundConfig(1.0, 2.0, 0.5),))


@pytest.mark.parametrize("config", [SnapConfig(), SnapConfig.paper(), ONE_ROUND])
def test_survives_json(config) -> None:
    assert SnapConfig.from_dict(json.loads(json.dumps(config.to_dict()))) == config


def test_paper_is_to_the_letter() -> None:
    config = SnapConfig.paper()
    assert config.method == "particle_filter"
    assert (config.particle_filter.particles, config.particle_filter.iterations) == (625, 640)
    assert SnapConfig.from_dict({"preset": "paper"}) == config


def test_partial_values_lie_over_the_defaults() -> None:
    config = SnapConfig.from_dict({"proposals": {"count": 100}, "wide_epsilon": 1})
    assert config.proposals.count == 100
    assert config.wide_epsilon == 1.0
    assert config.proposals.scales == SnapConfig().proposals.scales
    assert SnapConfig.from_dict({}) == SnapConfig()


def test_stages_may_be_fewer() -> None:
    stage = SnapConfig().to_dict()["stages"][0]
    assert len(SnapConfig.from_dict({"stages": [stage]}).stages) == 1


@pytest.mark.parametrize(
    ("values", "name"),
    [
        ({"speed": 1}, "config.speed"),
        ({"proposals": {"number": 1}}, "config.proposals.number"),
        ({"proposals": 3}, "config.proposals"),
        ({"proposals": {"count": 1.5}}, "config.proposals.count"),
        ({"proposals": {"count": True}}, "config.proposals.count"),
        ({"proposals": {"count": 0}}, "config.proposals.count"),
        ({"proposals": {"count": 10**9}}, "config.proposals.count"),
        ({"selection": {"classes": [1.0]}}, "config.selection.classes"),
        ({"rounds": [{"share": 0.1}] * 65}, "config.rounds"),
        ({"rounds": [{"share": -0.1}]}, r"config.rounds\[0\].share"),
        ({"rounds": [0.5]}, r"config.rounds\[0\] is 0.5: expected `object`"),
        ({"confidence": {"mode_radius": 0}}, "config.confidence.mode_radius"),
        ({"confidence": {"temperature": 0.0}}, "config.confidence.temperature"),
        ({"confidence": {"weights": [-1e9] * len(FEATURES)}}, r"config.confidence.weights\[0\]"),
        ({"spread": {"translation": 0}}, "config.spread.translation is 0: expected `float` >= 1e-06"),
        ({"spread": {"search": -1}}, "config.spread.search"),
        ({"stages": [{"niche_translation": 0}]}, r"config.stages\[0\].niche_translation"),
        ({"stages": [{"iterations": 10**6}]}, r"config.stages\[0\].iterations"),
        ({"particle_filter": {"alpha": -1}}, "config.particle_filter.alpha"),
        ({"observation": {"reach": -0.5}}, "config.observation.reach"),
        ({"wide_epsilon": 10**400}, "config.wide_epsilon"),
        ({"proposals": {"scales": [1.0, "a", 1.0, 1.0]}}, r"config.proposals.scales\[1\]"),
        ({"wide_epsilon": "2 cm"}, "config.wide_epsilon"),
        ({"wide_epsilon": float("nan")}, "config.wide_epsilon"),
        ({"stages": []}, "config.stages"),
        ({"stages": [{"points": "all"}]}, r"config.stages\[0\].points"),
        ({"method": "magic"}, "config.method must be one of viewpoint, particle_filter; it is 'magic'"),
        ({"preset": "fastest"}, "config.preset"),
        ([], "config"),
    ],
)
def test_wrong_fields_are_named(values, name) -> None:
    with pytest.raises(ValueError, match=name):
        SnapConfig.from_dict(values)


def test_a_long_wrong_value_is_cut_short() -> None:
    with pytest.raises(ValueError, match="wide_epsilon") as caught:
        SnapConfig.from_dict({"wide_epsilon": "x" * 5000})
    assert len(str(caught.value)) < 200
