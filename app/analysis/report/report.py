"""The report of a study: from the database to curves and all that is read off them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from app.analysis.statistics.cells import Cell, cells_of, key_of
from app.analysis.statistics.comparison import Comparison, comparisons
from app.analysis.statistics.curves import MARGINS, PAPER_SECONDS, SNAP_SECONDS, Timing
from app.analysis.statistics.gains import Gain, gains
from app.analysis.statistics.units import told
from app.analysis.study_data.collect import Collected, TruthSource, trials_of
from app.analysis.study_data.remarks import Remark, counted
from app.analysis.study_data.selection import Selection
from app.analysis.study_data.trial import ERROR_KINDS, TrialTrace
from app.storage.database import Database


@dataclass(frozen=True)
class ReportConfig:
    """How a report is computed; stated in it."""

    snap_seconds: float = SNAP_SECONDS
    """That each offline snap by the default is charged with."""
    without_idle: bool = False
    """Whether idle time is left out."""
    truth: TruthSource = "operators"
    seed: int = 0
    """Of the bootstrap."""
    paper_seconds: float = PAPER_SECONDS
    """That each offline snap by the paper's filter is charged with."""

    @property
    def timing(self) -> Timing:
        """How time is counted."""
        return Timing(self.snap_seconds, self.without_idle, self.paper_seconds)


@dataclass(frozen=True, eq=False)
class Report:
    """All numbers of a study, or of a part of it."""

    collected: Collected
    config: ReportConfig
    cells: Sequence[Cell]
    gains: Sequence[Gain]
    comparisons: Sequence[Comparison]
    remarks: Sequence[Remark]


def study_report(
    database: Database,
    study_id: int,
    config: ReportConfig | None = None,
    part: Selection | None = None,
) -> Report:
    """The report of a study, or of a part of it.

    Raises:
        LookupError: where there is no such study.
        ValueError: where a part is none of the study's.
    """
    config = config or ReportConfig()
    collected = trials_of(database, study_id, config.truth)
    return report_of(part.of(collected) if part else collected, config)


def report_of(collected: Collected, config: ReportConfig) -> Report:
    """The report of what was collected."""
    trials = sorted(collected.trials, key=_order(collected))
    return Report(
        collected=replace(collected, trials=trials),
        config=config,
        cells=cells_of(trials, config.timing, config.seed),
        gains=[gain for _, part in groupby(trials, key=key_of) for gain in gains(list(part), config.seed)],
        comparisons=comparisons(trials, config.timing, config.seed),
        remarks=[*collected.remarks, *_idle(trials, config), *_never_within(trials)],
    )


def _order(collected: Collected) -> Callable[[TrialTrace], tuple[int, str, bool, str, int]]:
    """Groups as the study has them, then modes, then conditions with the baseline first."""
    groups = list(collected.groups)
    return lambda trial: (
        groups.index(trial.group),
        trial.mode,
        trial.condition != "manual",
        trial.condition,
        trial.registration_id,
    )


def _idle(trials: Sequence[TrialTrace], config: ReportConfig) -> list[Remark]:
    """How much of the time nothing happened: one long absence may outweigh all others in a mean."""
    idle = [float(trial.seconds[-1] - trial.active_seconds[-1]) for trial in trials]
    count = sum(seconds > 0.0 for seconds in idle)
    if not count:
        return []
    longest = int(np.argmax(idle))
    text = (
        f"{count} of {counted(len(trials), 'trial')} {'has' if count == 1 else 'have'} some,"
        f" {sum(idle):.0f} s in all and at most {idle[longest]:.0f} s, of {trials[longest].operator};"
        f" it {'is left out' if config.without_idle else 'counts'}"
    )
    return [Remark("idle time", text, trials[longest].registration_id)]


def _never_within(trials: Sequence[TrialTrace]) -> list[Remark]:
    """Trials that come within no margin at all: they count in the shares, in no mean."""
    return [
        Remark(
            f"{trial.operator}, {trial.scene}, {trial.object}, {trial.mode}, {trial.condition}",
            f"never came within the largest margin of {kind}, {told(float(MARGINS[kind][0]), kind)}:"
            f" counts among those who do not reach a margin, and in no mean",
            trial.registration_id,
        )
        for trial in trials
        for kind in ERROR_KINDS
        if np.nanmin(trial.of_kind(kind)) > MARGINS[kind][0]
    ]
