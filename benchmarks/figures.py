"""Measured figures beside their targets, and the table that shows them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from rich.table import Table

DIGITS = {"s": 3, "ms": 1, "%": 1, "times": 2, "actions": 1, "°": 1}
"""Decimals shown by unit; of others none."""


@dataclass(frozen=True)
class Target:
    """What a figure has to reach."""

    value: float
    at_least: bool = False
    """Otherwise the figure must not be larger."""

    def is_reached(self, value: float) -> bool:
        """Whether a measured value is good enough."""
        return value >= self.value if self.at_least else value <= self.value


@dataclass(frozen=True)
class Figure:
    """One measured number."""

    name: str
    value: float
    unit: str
    target: Target | None = None

    @property
    def is_missed(self) -> bool:
        """Whether there is a target and the value is not good enough for it."""
        return self.target is not None and not self.target.is_reached(self.value)


def percentile(values: Sequence[float], share: float) -> float:
    """The value below which `share` percent of the values lie; NaN, which reaches no target, of none."""
    return float(np.percentile(values, share)) if len(values) else float("nan")


def spread(name: str, seconds: Sequence[float], p95_target: Target | None = None) -> list[Figure]:
    """Median and 95th percentile of durations."""
    return [
        Figure(f"{name}, median", percentile(seconds, 50), "s"),
        Figure(f"{name}, p95", percentile(seconds, 95), "s", p95_target),
    ]


def table(title: str, figures: Sequence[Figure]) -> Table:
    """A table for people."""
    result = Table(title=title, title_justify="left", title_style="bold")
    result.add_column("figure", overflow="fold")
    result.add_column("measured", justify="right", no_wrap=True)
    result.add_column("target", justify="right", no_wrap=True)
    result.add_column("reached", no_wrap=True)
    for figure in figures:
        result.add_row(figure.name, _amount(figure.value, figure.unit), *_judged(figure))
    return result


def _judged(figure: Figure) -> tuple[str, str]:
    if figure.target is None:
        return "", ""
    sign = "≥" if figure.target.at_least else "≤"
    verdict = "[red]no[/red]" if figure.is_missed else "[green]yes[/green]"
    return f"{sign} {_amount(figure.target.value, figure.unit)}", verdict


def _amount(value: float, unit: str) -> str:
    digits = f"{value:,.{DIGITS.get(unit, 0)}f}"
    return f"{digits} {unit}".strip()
