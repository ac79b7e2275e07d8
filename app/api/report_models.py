"""What reports tell over REST: margins in metres or radians, times in seconds, null for what is unknown."""

import math
from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel, Field

from app.analysis.statistics.bootstrap import Interval
from app.analysis.statistics.cautions import fitts_caution, hand_off_caution
from app.analysis.statistics.cells import Cell, Drawn, StgCurve
from app.analysis.statistics.comparison import Comparison
from app.analysis.statistics.fitts import Fitts
from app.analysis.statistics.gains import Gain, Moment
from app.analysis.statistics.hand_off import HandOff
from app.analysis.study_data.remarks import Remark
from app.analysis.study_data.trial import ErrorKind
from app.storage.tables import Method


class IntervalOut(BaseModel):
    """A mean over operators with its 95 % interval."""

    mean: float | None
    low: float | None
    high: float | None
    operators: int


class PointOut(BaseModel):
    """A curve at one margin."""

    margin: float
    seconds: float | None = Field(description="mean over the operators who come within the margin")
    low: float | None
    high: float | None
    operators: int
    trials: int
    share: float = Field(description="of the trials that come within it, averaged over operators")
    registration_id: int | None = Field(description="whose time is nearest to the mean; to be replayed")


class FittsOut(BaseModel):
    """time = a + b log2(distance / margin + 1)."""

    distance: float
    margins: int
    bits: tuple[float, float] = Field(description="the least and the greatest index of difficulty")
    operators: int = Field(description="at the margin that fewest come within, as are the trials")
    trials: int
    a: float
    a_interval: tuple[float | None, float | None]
    b: float
    b_interval: tuple[float | None, float | None]
    r_squared: float | None
    throughput: float | None = Field(description="bits a second")
    throughput_interval: tuple[float | None, float | None]


class CurveOut(BaseModel):
    """From large margins to small ones."""

    points: list[PointOut]
    fitts: FittsOut | None
    fitts_caution: str = Field(description="why it tells little or is not there; empty where all is well")


class HandOffOut(BaseModel):
    """Where a snap begins to save time, and where it saves most."""

    margin: float
    is_largest: bool = Field(description="of all margins: the curves may part farther out")
    is_smallest: bool = Field(description="at no smaller one there are enough operators to compare")
    best_margin: float
    saved: float
    saved_interval: tuple[float, float]
    operators: int
    caution: str = Field(description="why it tells little; empty where nothing speaks against it")


class StgOut(CurveOut):
    """The curve of snaps by one method."""

    hand_off: HandOffOut | None


class CellOut(BaseModel):
    """The curves of a group, mode and condition by one error."""

    group: str
    mode: str
    condition: str
    error: ErrorKind
    operators: int
    trials: int
    human: CurveOut
    stg: dict[Method, StgOut] = Field(description="by the methods by which any snap was computed")


class GainOut(BaseModel):
    """Errors before and after a snap."""

    group: str
    mode: str
    condition: str
    method: Method
    error: ErrorKind
    moment: Moment
    before: IntervalOut
    after: IntervalOut
    gain: IntervalOut
    improved: float | None
    trials: int
    verdict: str
    sentence: str


class ComparisonOut(BaseModel):
    """Differences second - first over pairs of the same operator and task."""

    group: str = Field(description="or `all groups`")
    mode: str
    first: str
    second: str
    pairs: int
    seconds: IntervalOut
    translation: IntervalOut
    rotation: IntervalOut


class RemarkOut(BaseModel):
    """What was left out or handled, and why."""

    about: str
    text: str
    registration_id: int | None


def cell_out(cell: Cell) -> CellOut:
    """A cell as JSON."""
    return CellOut(
        group=cell.group,
        mode=cell.mode,
        condition=cell.condition,
        error=cell.error,
        operators=cell.operators,
        trials=cell.trials,
        human=CurveOut(**_curve(cell.human)),
        stg={method: _stg(curve) for method, curve in cell.stg.items()},
    )


def gain_out(gain: Gain) -> GainOut:
    """A gain as JSON."""
    intervals = {name: interval_out(getattr(gain, name)) for name in ("before", "after", "gain")}
    more = {"improved": number(gain.improved), "verdict": gain.verdict, "sentence": gain.sentence}
    return GainOut(**{**vars(gain), **intervals, **more})


def comparison_out(pair: Comparison) -> ComparisonOut:
    """A comparison as JSON."""
    intervals = {name: interval_out(getattr(pair, name)) for name in ("seconds", "translation", "rotation")}
    return ComparisonOut(**{**vars(pair), **intervals})


def remarks_out(remarks: Sequence[Remark]) -> list[RemarkOut]:
    """Remarks as JSON."""
    return [RemarkOut(**vars(remark)) for remark in remarks]


def interval_out(interval: Interval) -> IntervalOut:
    """An interval as JSON."""
    mean, low, high = (number(value) for value in interval[:3])
    return IntervalOut(mean=mean, low=low, high=high, operators=interval.operators)


def number(value: float) -> float | None:
    """None for NaN, which JSON does not know."""
    return float(value) if math.isfinite(value) else None


def _stg(drawn: StgCurve) -> StgOut:
    return StgOut(**_curve(drawn), hand_off=None if drawn.hand_off is None else _hand_off(drawn.hand_off))


def _hand_off(point: HandOff) -> HandOffOut:
    return HandOffOut(**vars(point), caution=hand_off_caution(point))


def _curve(drawn: Drawn) -> dict[str, Any]:
    curve = drawn.curve
    return {
        "points": [
            PointOut(
                margin=float(curve.margins[k]),
                seconds=number(curve.mean[k]),
                low=number(curve.low[k]),
                high=number(curve.high[k]),
                operators=int(curve.operators[k]),
                trials=int(curve.trials[k]),
                share=float(curve.share[k]),
                registration_id=drawn.registration_ids[k],
            )
            for k in range(len(curve.margins))
        ],
        "fitts": None if drawn.fitts is None else _fitts(drawn.fitts),
        "fitts_caution": fitts_caution(drawn.fitts),
    }


def _fitts(line: Fitts) -> FittsOut:
    return FittsOut(
        distance=line.distance,
        margins=line.margins,
        bits=line.bits,
        operators=line.operators,
        trials=line.trials,
        a=line.a,
        a_interval=(number(line.a_interval[0]), number(line.a_interval[1])),
        b=line.b,
        b_interval=(number(line.b_interval[0]), number(line.b_interval[1])),
        r_squared=number(line.r_squared),
        throughput=number(line.throughput),
        throughput_interval=(number(line.throughput_interval[0]), number(line.throughput_interval[1])),
    )
