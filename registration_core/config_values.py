"""Records of constants to JSON values and back, each value within its bounds: they come from outside."""

import dataclasses
import typing
from typing import Any, Literal

MOST_OF_ANYTHING = 1_000_000
"""No count may be larger."""
MOST = {"tries": 64, "plane_trials": 10_000, "normal_radius": 16, "modes": 5_000, "iterations": 10_000}
"""Counts that may not even be as large, or one compiled call would go on for too long."""
LARGEST = 1e6
"""No number may be larger, nor smaller than its negative."""
SMALL = 1e-6
LEAST = {
    **dict.fromkeys(("translation", "rotation", "search", "belief", "temperature", "mode_radius"), SMALL),
    **dict.fromkeys(
        ("niche_translation", "niche_rotation", "tukey_start", "tukey_end", "epsilon", "widening"), SMALL
    ),
    **dict.fromkeys(("wide_epsilon", "depth_gap", "plane_tolerance", "max_shift", "max_turn"), SMALL),
    **dict.fromkeys(("reach", "noise_translation", "noise_rotation", "alpha", "beta", "scales"), 0.0),
    **dict.fromkeys(("share", "doubt", "plane_weight", "gaussian_share", "ray_share", "least_share"), 0.0),
}
"""Numbers that must not be smaller than this, by the name of their field."""
FIXED_LENGTH = ("classes", "weights")
"""Lists whose items have a meaning by their place."""
MOST_ITEMS = 64
"""Of any list."""
SHOWN = 60
"""Characters of a wrong value that a message repeats."""


def plain(value: Any) -> Any:
    """Nested records as JSON values."""
    if dataclasses.is_dataclass(value):
        return {f.name: plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    return [plain(item) for item in value] if isinstance(value, tuple) else value


def merged(base: Any, values: Any, name: str) -> Any:
    """The record `base` with `values` in place of its fields.

    Raises:
        ValueError: naming the field that is unknown, of the wrong type or out of its bounds.
    """
    if not isinstance(values, dict):
        raise ValueError(f"{name} must be an object of named fields; it is {values!r}")
    kinds = typing.get_type_hints(type(base))
    for key in values:
        if key not in kinds:
            raise ValueError(f"{name}.{key} is no field; there are {', '.join(kinds)}")
    changes = {
        key: _checked(kinds[key], getattr(base, key), value, f"{name}.{key}") for key, value in values.items()
    }
    return dataclasses.replace(base, **changes)


def _checked(kind: Any, base: Any, value: Any, name: str) -> Any:
    """`value` as a field of type `kind`, whose value so far is `base`."""
    if dataclasses.is_dataclass(kind):
        return merged(base, value, name)
    if typing.get_origin(kind) is Literal:
        if value not in typing.get_args(kind):
            raise ValueError(
                f"{name} must be one of {', '.join(typing.get_args(kind))}; it is {shown(value)}"
            )
        return value
    if typing.get_origin(kind) is tuple:
        return _checked_items(typing.get_args(kind)[0], base, value, name)
    return _checked_number(kind, value, name)


def _checked_number(kind: Any, value: Any, name: str) -> int | float:
    assert kind in (int, float)
    field = name.rpartition(".")[2].partition("[")[0]
    is_number = isinstance(value, int if kind is int else int | float) and not isinstance(value, bool)
    if kind is int:
        most = MOST.get(field, MOST_OF_ANYTHING)
        if not is_number or not 1 <= value <= most:
            raise ValueError(f"{name} must be a whole number from 1 to {most}; it is {shown(value)}")
        return int(value)
    least = LEAST.get(field, -LARGEST)
    if not is_number or not least <= value <= LARGEST:
        raise ValueError(f"{name} must be a number from {least:g} to {LARGEST:g}; it is {shown(value)}")
    return float(value)


def shown(value: Any) -> str:
    """A value for a message, cut short where it is long."""
    text = repr(value)
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}..."


def _checked_items(kind: Any, base: Any, value: Any, name: str) -> Any:
    if not isinstance(value, list | tuple) or not value:
        raise ValueError(f"{name} must be a list with at least one item; it is {shown(value)}")
    if name.rpartition(".")[2] in FIXED_LENGTH and len(value) != len(base):
        raise ValueError(f"{name} must have {len(base)} numbers; it has {len(value)}")
    if len(value) > MOST_ITEMS:
        raise ValueError(f"{name} must have at most {MOST_ITEMS} items; it has {len(value)}")
    last = len(base) - 1
    return tuple(_checked(kind, base[min(i, last)], item, f"{name}[{i}]") for i, item in enumerate(value))
