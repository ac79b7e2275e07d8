"""Finds what is known by lying in a folder: the `FORMAT` of each module of a package."""

import importlib
import pkgutil
from typing import Any


def formats_in(package: str) -> list[Any]:
    """The `FORMAT` of every module of a package that has one, in the order of the modules' names."""
    folder = importlib.import_module(package).__path__
    modules = [importlib.import_module(f"{package}.{found.name}") for found in pkgutil.iter_modules(folder)]
    return [module.FORMAT for module in modules if hasattr(module, "FORMAT")]
