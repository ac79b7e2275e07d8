"""Knows the formats of exports: every module of this folder that has a `FORMAT` is one."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType

from app.members import members_of


@dataclass(frozen=True)
class ExportFormat:
    """A form in which people get what went through the gate."""

    name: str
    """As REST and the command line call it."""
    title: str
    """As the page calls it."""
    write: Callable[[Path, Path], object]
    """Makes a new folder, the second path, of a checked BOP dataset, the first, which is then not needed."""


@cache
def formats() -> Mapping[str, ExportFormat]:
    """All formats by name; the whole dataset comes first."""
    found: list[ExportFormat] = members_of(__package__, "FORMAT")
    return MappingProxyType({one.name: one for one in found})
