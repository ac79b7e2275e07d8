"""When a fit of Fitts' law or a hand-off point tells little, and why, in words beside its numbers."""

import math
from collections.abc import Iterator

from app.analysis.statistics.fitts import LEAST_MARGINS, Fitts
from app.analysis.statistics.hand_off import HandOff
from app.analysis.statistics.units import number_told
from app.analysis.study_data.remarks import counted

LEAST_OPERATORS = 6
"""Of fewer, the 2.5th percentile of a bootstrap hangs on some single draws: there are C(2n - 1, n) different
ones, 462 of six operators, but 126 of five and 35 of four."""
LEAST_BITS = 3.0
"""Half of the range from 2 to 8 bits that Soukoreff and MacKenzie (2004) recommend."""
LEAST_R_SQUARED = 0.9
"""Fits to movements that follow the law usually come above it (MacKenzie, 1992)."""
WIDEST = 1.0
"""Width of an interval as a share of its value: its ends are then about threefold apart."""


def fitts_caution(line: Fitts | None) -> str:
    """Why a fit tells little or is not there, in one sentence; empty where nothing speaks against it."""
    if line is None:
        return (
            f"There is no line: it takes {LEAST_MARGINS} margins within D that half of the operators reach."
        )
    return _sentence("This fit tells little", _against_fit(line))


def hand_off_caution(point: HandOff) -> str:
    """Why a hand-off point tells little, in one sentence; empty where nothing speaks against it."""
    return _sentence("This point tells little", _against_point(point))


def _sentence(start: str, reasons: Iterator[str]) -> str:
    text = "; ".join(reasons)
    return f"{start}: {text}." if text else ""


def _against_fit(line: Fitts) -> Iterator[str]:
    least, most = line.bits
    if line.operators < LEAST_OPERATORS:
        yield f"{counted(line.trials, 'trial')} of {counted(line.operators, 'operator')}"
    if most - least < LEAST_BITS:
        yield f"its difficulties cover {number_told(most - least)} bits, less than {LEAST_BITS:g}"
    if line.r_squared < LEAST_R_SQUARED:
        yield f"R² is {number_told(line.r_squared)}, below {LEAST_R_SQUARED:g}"
    yield from _against_slope(line.b, line.b_interval)


def _against_slope(b: float, interval: tuple[float, float]) -> Iterator[str]:
    low, high = interval
    if b < 0 and not high >= 0:
        yield f"the slope is negative ({number_told(b)} s a bit)"
    elif low <= 0 <= high:
        yield f"the slope may be zero ({_range(interval)} a bit)"
    elif math.isnan(low) and b == 0:
        yield "the slope is zero"
    elif _is_wide(b, interval):
        yield f"the slope may be anything from {_range(interval)} a bit"


def _against_point(point: HandOff) -> Iterator[str]:
    if point.operators < LEAST_OPERATORS:
        yield counted(point.operators, "operator")
    if point.is_largest:
        yield "it is the largest margin of all, the curves may part farther out"
    if point.is_smallest:
        yield "it is the smallest margin that enough operators come within, and the only one"
    if _is_wide(point.saved, point.saved_interval):
        yield f"what a snap saves may be anything from {_range(point.saved_interval)}"


def _is_wide(value: float, interval: tuple[float, float]) -> bool:
    low, high = interval
    return high - low > WIDEST * value


def _range(interval: tuple[float, float]) -> str:
    low, high = interval
    return f"{number_told(low)} to {number_told(high)} s"
