"""What a snap can be computed with, by name: the fast default, and the paper's particle filter."""

from collections.abc import Mapping
from typing import Any

from app.storage.tables import Method
from registration_core import SnapConfig


def config_of(method: Method) -> SnapConfig:
    """The configuration of a method as it is, with nothing changed."""
    return SnapConfig.from_dict({"preset": method})


def method_of(config: Mapping[str, Any]) -> Method:
    """The method of a configuration as JSON keeps it, whatever else was changed in it."""
    return "paper" if config["method"] == "particle_filter" else "default"
