"""What the values of a configuration may be, and records from JSON values that come from outside."""

import re
import reprlib
from typing import Annotated, Any, TypeVar

import msgspec
from msgspec import Meta

T = TypeVar("T")

Count = Annotated[int, Meta(ge=1, le=1_000_000)]
Number = Annotated[float, Meta(ge=-1e6, le=1e6)]
NotNegative = Annotated[float, Meta(ge=0.0, le=1e6)]
Positive = Annotated[float, Meta(ge=1e-6, le=1e6)]
Items = Annotated[tuple[T, ...], Meta(min_length=1, max_length=64)]


def at_most(count: int) -> Meta:
    """The bounds of a count that may be less large than others, or one compiled call would go on too long."""
    return Meta(ge=1, le=count)


def as_many_as(numbers: tuple[float, ...]) -> Meta:
    """The bounds of a list whose items have a meaning by their place."""
    return Meta(min_length=len(numbers), max_length=len(numbers))


def overlaid(base: Any, values: Any, name: str) -> Any:
    """The JSON values `base` with `values` in place of theirs; items of a list lie over those in their place.

    Raises:
        ValueError: naming the field that is unknown.
    """
    if isinstance(base, dict) and isinstance(values, dict):
        for key in values:
            if key not in base:
                raise ValueError(f"{name}.{key} is no field; there are {', '.join(base)}")
        return base | {key: overlaid(base[key], value, f"{name}.{key}") for key, value in values.items()}
    if isinstance(base, list) and base and isinstance(values, list):
        last = len(base) - 1
        return [overlaid(base[min(i, last)], item, f"{name}[{i}]") for i, item in enumerate(values)]
    return values


def converted(values: Any, kind: type[T], name: str) -> T:
    """JSON values as a record.

    Raises:
        ValueError: naming the field that is of the wrong type or out of its bounds, and what is expected.
    """
    try:
        return msgspec.convert(values, kind)
    except msgspec.ValidationError as error:
        wrong, _, path = str(error).partition(" - at `$")
        path = path.rstrip("`")
        for field, index in re.findall(r"\.(\w+)|\[(\d+)\]", path):
            values = values[field or int(index)]
        value, expected = f"{reprlib.repr(values):.60}", f"{wrong[0].lower()}{wrong[1:]}"
        raise ValueError(f"{name}{path} is {value}: {expected}") from error
