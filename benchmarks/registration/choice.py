"""A part of the whole run, for whoever tries something out: which sets, which methods, how many starts."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

SETS_VARIABLE, METHODS_VARIABLE = "BENCHMARK_SETS", "BENCHMARK_METHODS"
STARTS_VARIABLE = "BENCHMARK_STARTS"


@dataclass(frozen=True)
class Choice:
    """What of everything is run."""

    sets: tuple[str, ...]
    methods: tuple[str, ...]
    starts: int | None
    """From each shell about each instance, at most; None leaves it at what a set has."""
    is_part: bool
    """Whether anything was left out; what is measured beside the trials is then left out, too."""

    @classmethod
    def read(
        cls,
        sets: Sequence[str],
        usual_sets: Sequence[str],
        methods: Sequence[str],
        environment: Mapping[str, str] = os.environ,
    ) -> "Choice":
        """The usual ones of the given sets, and all methods, but for what environment variables say.

        `BENCHMARK_SETS=moro,apc`, `BENCHMARK_METHODS=default,prototype`: names, or parts of names, which mean
        all that hold them. `BENCHMARK_STARTS=2`.

        Raises:
            ValueError: naming the variable, and what in it fits nothing.
        """
        starts = environment.get(STARTS_VARIABLE)
        if starts is not None and not (starts.isdecimal() and int(starts) > 0):
            raise ValueError(f"{STARTS_VARIABLE} must be a whole number from 1 on; it is {starts!r}")
        return cls(
            _chosen(SETS_VARIABLE, sets, usual_sets, environment),
            _chosen(METHODS_VARIABLE, methods, methods, environment),
            int(starts) if starts is not None else None,
            any(name in environment for name in (SETS_VARIABLE, METHODS_VARIABLE, STARTS_VARIABLE)),
        )


def _chosen(
    variable: str, names: Sequence[str], usual: Sequence[str], environment: Mapping[str, str]
) -> tuple[str, ...]:
    text = environment.get(variable)
    if text is None:
        return tuple(usual)
    chosen: list[str] = []
    for part in text.split(","):
        wanted = part.strip().lower()
        found = [name for name in names if name.lower() == wanted] or [
            name for name in names if wanted and wanted in name.lower()
        ]
        if not found:
            raise ValueError(f"{variable}: nothing is called {part.strip()!r}; choose of {'; '.join(names)}")
        chosen += found
    return tuple(name for name in names if name in chosen)
