"""Knows the formats of exports: every module of this folder that has a `FORMAT` is one."""

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType

PACKAGE = __name__.rpartition(".")[0]


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
    names = [module.name for module in pkgutil.iter_modules([str(Path(__file__).parent)])]
    modules = [importlib.import_module(f"{PACKAGE}.{name}") for name in sorted(names)]
    found: list[ExportFormat] = [module.FORMAT for module in modules if hasattr(module, "FORMAT")]
    return MappingProxyType({one.name: one for one in found})
