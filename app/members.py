"""Finds what is known by lying in a folder, such as the `FORMAT` of each module of a package."""

import importlib
import pkgutil
from typing import Any


def members_of(package: str, name: str) -> list[Any]:
    """What every module of a package that has it calls `name`, in the order of the modules' names."""
    folder = importlib.import_module(package).__path__
    modules = [importlib.import_module(f"{package}.{found.name}") for found in pkgutil.iter_modules(folder)]
    return [getattr(module, name) for module in modules if hasattr(module, name)]
