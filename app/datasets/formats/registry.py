"""Knows the formats of imports: every module of this folder that has a `FORMAT` is one."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from app.members import members_of


@dataclass(frozen=True)
class ImportFormat:
    """A form in which people bring datasets."""

    name: str
    recognises: Callable[[Path], bool]
    """Whether a folder holds one."""
    as_bop: Callable[[Path, Path], Path]
    """The root of the same dataset in the form of BOP; the second folder is empty, for what is to be written.
    Raises ValueError, in one sentence, where there is none."""


@cache
def formats() -> tuple[ImportFormat, ...]:
    """All formats; BOP is asked last, and takes whatever no other one recognises."""
    found: list[ImportFormat] = members_of(__package__, "FORMAT")
    return tuple(sorted(found, key=lambda one: (one.name == "bop", one.name)))


def as_bop(folder: Path, work: Path) -> Path:
    """The root of the dataset in a folder, in the form of BOP.

    Args:
        folder: The dataset's, or one that it lies in.
        work: An empty folder, which must stay as long as the dataset is read.

    Raises:
        ValueError: where no format recognises it; what was found is said as for BOP.
    """
    return next(one for one in formats() if one.recognises(folder)).as_bop(folder, work)
