"""Side by side for people: a row a method, a column a shell."""

from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.registration.methods import METHODS
from benchmarks.registration.starts import Shell
from benchmarks.registration.statistics import (
    ACCEPTED_GOOD,
    Share,
    auroc,
    calibration_error,
    false_accepts,
    measure_over_scenes,
    percentiles,
    reliability,
    share_over_scenes,
)
from benchmarks.registration.trials import Trial

CONFIDENCE_MEASURES = (auroc, calibration_error, false_accepts)
MEASURES = {
    "ADD(-S) < 10 % of the diameter": "is_right",
    "MSSD < 5 % of the diameter": "is_exact",
    "within 2 mm and 2 degrees": "is_close",
}


def print_tables(console: Console, trials: Sequence[Trial], set_name: str) -> None:
    """Successes with their 95 % intervals, what became worse, and seconds, of one set."""
    own = [trial for trial in trials if trial.set_name == set_name]
    shells = list(dict.fromkeys(trial.shell for trial in own))
    methods = [name for name in METHODS if any(trial.method == name for trial in own)]
    instances, scenes = len({trial.instance for trial in own}), len({trial.scene for trial in own})
    for title, flag in MEASURES.items():
        table = _table(f"{set_name} ({instances} instances, {scenes} scenes): {title}, %", shells)
        for name in methods:
            table.add_row(name, *(_success(_of(own, name, shell), flag) for shell in shells))
        console.print(table)
    table = _table(f"{set_name}: rotation error at least that of the start, %; starts", shells)
    for name in methods:
        table.add_row(name, *(_not_better(_of(own, name, shell)) for shell in shells))
    console.print(table)
    table = _table(f"{set_name}: milliseconds, median / p95", shells)
    for name in methods:
        table.add_row(name, *(_milliseconds(_of(own, name, shell)) for shell in shells))
    console.print(table)


def print_confidences(console: Console, trials: Sequence[Trial]) -> None:
    """What the confidence of one method is worth, a row a set; good starts do not count."""
    columns = ("AUROC", "calibration error", f"wrong accepted with {100 * ACCEPTED_GOOD:.0f} % of the good")
    table = Table(title="Confidence that the MSSD is below 5 %, %", title_justify="left")
    table.add_column("set", no_wrap=True)
    for column in ("right", *columns):
        table.add_column(column, justify="right")
    for name in dict.fromkeys(trial.set_name for trial in trials):
        own = [trial for trial in trials if trial.set_name == name]
        claims, scenes = [trial.claim for trial in own], [trial.scene for trial in own]
        exact = [trial.error.is_exact for trial in own]
        shares = [
            share_over_scenes(exact, scenes),
            *(measure_over_scenes(measure, claims, exact, scenes) for measure in CONFIDENCE_MEASURES),
        ]
        table.add_row(name, *(_with_interval(share) for share in shares))
    console.print(table)


def print_made_worse(console: Console, trials: Sequence[Trial]) -> None:
    """Of the trials from good poses, the share that ended further off, a row a set."""
    methods = [name for name in METHODS if any(trial.method == name for trial in trials)]
    table = Table(title="Good poses made worse than 3 mm or 3 degrees, %", title_justify="left")
    for column in ("set", *methods):
        table.add_column(column, justify="left" if column == "set" else "right")
    for name in dict.fromkeys(trial.set_name for trial in trials):
        own = [trial for trial in trials if trial.set_name == name]
        by_method = [[trial for trial in own if trial.method == method] for method in methods]
        table.add_row(name, *(_success(some, "is_worse_than_good") for some in by_method))
    console.print(table)


def print_reliability(console: Console, trials: Sequence[Trial], title: str) -> None:
    """Confidence beside what was right, in bins of equal count."""
    table = Table(title=f"Confidence, {title}", title_justify="left")
    for column in ("claimed %", "right %", "results"):
        table.add_column(column, justify="right")
    claims = [trial.claim for trial in trials]
    for part in reliability(claims, [trial.error.is_exact for trial in trials]):
        table.add_row(f"{100 * part.confidence:.1f}", f"{100 * part.correct:.1f}", str(part.count))
    console.print(table)


def _table(title: str, shells: Sequence[Shell]) -> Table:
    table = Table(title=title, title_justify="left")
    table.add_column("method", no_wrap=True)
    for shell in shells:
        table.add_column(str(shell), justify="right", no_wrap=True)
    return table


def _of(trials: Sequence[Trial], method: str, shell: Shell) -> list[Trial]:
    return [trial for trial in trials if trial.method == method and trial.shell == shell]


def _success(trials: Sequence[Trial], flag: str) -> str:
    if not trials:
        return ""
    share = share_over_scenes([getattr(t.error, flag) for t in trials], [t.scene for t in trials])
    return _with_interval(share)


def _with_interval(share: Share) -> str:
    if np.isnan(share.value):
        return "-"
    interval = f" ({100 * share.low:.0f}-{100 * share.high:.0f})" if not np.isnan(share.low) else ""
    return f"{100 * share.value:.1f}{interval}"


def _not_better(trials: Sequence[Trial]) -> str:
    if not trials:
        return ""
    worse = sum(trial.error.rotation >= trial.start_error.rotation for trial in trials)
    return f"{100 * worse / len(trials):.1f}; {len(trials)}"


def _milliseconds(trials: Sequence[Trial]) -> str:
    if not trials:
        return ""
    median, p95 = percentiles([trial.seconds for trial in trials])
    return f"{1000 * median:,.0f} / {1000 * p95:,.0f}"
