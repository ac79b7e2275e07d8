"""The figure of a report, in the layout of the paper's Figure 2; the same bytes for the same numbers.

Error margin from large to small, seconds on the left axis, share of trials that come within it on the right
one, as a faint shade with a dotted edge; a column a group, a row an error with one scale of seconds. Red and
solid is the human, blue and dashed is STG, ochre and dash-dotted is STG by the paper's filter; accurate is
thick, quick is thin with marks.
"""

import io
import threading
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, NullFormatter

from app.analysis.report.report import Report
from app.analysis.statistics.cells import CURVE_NAMES, Cell, Drawn
from app.analysis.statistics.units import UNITS, in_people_units
from app.analysis.study_data.trial import ERROR_KINDS, ErrorKind
from app.storage.tables import Method

FigureFormat = Literal["svg", "pdf"]

Style = Literal["-", "--", "-."]
LOOKS: Mapping[Method | None, tuple[str, Style]] = {
    None: ("#b4231a", "-"),
    "default": ("#0b62a8", "--"),
    "paper": ("#a87400", "-."),
}
"""Colour and line of each curve."""
PANEL = (4.2, 3.1)
"""Inches."""
SETTINGS: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.size": 9,
    "svg.fonttype": "none",  # texts stay texts
    "svg.hashsalt": "snap6d",  # else names inside are random
    "pdf.fonttype": 42,
}
TICKS: dict[ErrorKind, Sequence[float]] = {
    "translation": (100, 50, 20, 10, 5, 2, 1),
    "rotation": (90, 45, 20, 10, 5, 2, 1),
}
"""Millimetres and degrees."""
SHARES, MOST_SHARE = (0.0, 0.25, 0.5, 0.75, 1.0), 1.04
"""Ticks on the right, and the end of that axis: a share of 1 is not hidden by the frame."""
_lock = threading.Lock()
"""matplotlib's settings are everybody's."""


def figure_bytes(report: Report, file_format: FigureFormat, condition: str | None = None) -> bytes:
    """The figure of a report as a file: of a condition, or of `manual`; where there is none, of the first."""
    sink = io.BytesIO()
    dates = {"Date": None} if file_format == "svg" else {"CreationDate": None, "ModDate": None}
    with _lock, mpl.rc_context(SETTINGS):
        draw(report, condition or shown_conditions(report)[0]).savefig(
            sink, format=file_format, metadata=dates
        )
    return sink.getvalue()


def draw(report: Report, condition: str) -> Figure:
    """Panels of one condition."""
    cells = [cell for cell in report.cells if cell.condition == condition]
    groups = list(report.collected.groups) or [""]
    figure = Figure((PANEL[0] * len(groups), PANEL[1] * len(ERROR_KINDS) + 0.9), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(len(ERROR_KINDS), len(groups), squeeze=False)
    for row, kind in zip(panels, ERROR_KINDS, strict=True):
        for panel, group in zip(row, groups, strict=True):
            here = [cell for cell in cells if cell.group == group and cell.error == kind]
            _draw_panel(panel, here, kind, f"{group}, {kind}")
        top = max(panel.get_ylim()[1] for panel in row)
        for panel in row:
            panel.set_ylim(0.0, top)
    figure.suptitle(_title(report, condition))
    figure.legend(handles=list(_legend(cells)), loc="outside lower center", ncols=4, frameon=False)
    if report.collected.is_simulated:
        figure.text(
            0.5,
            0.5,
            "simulated",
            fontsize=44,
            color="#777777",
            alpha=0.22,
            rotation=25,
            ha="center",
            va="center",
        )
    return figure


def shown_conditions(report: Report) -> list[str]:
    """The conditions that there are figures of, the baseline first; at least one, were it without curves."""
    conditions = dict.fromkeys(cell.condition for cell in report.cells)
    return sorted(conditions, key=lambda name: name != "manual") or ["manual"]


def _title(report: Report, condition: str) -> str:
    simulated = " (simulated operators)" if report.collected.is_simulated else ""
    return f"{report.collected.name}: {condition}{simulated}"


def _draw_panel(panel: Axes, cells: Sequence[Cell], kind: ErrorKind, title: str) -> None:
    panel.set_title(title, fontsize=10)
    shares = panel.twinx()
    panel.set_zorder(shares.get_zorder() + 1)
    panel.patch.set_visible(False)
    for cell in cells:
        for method, drawn in cell.curves:
            _draw_curve(panel, shares, drawn, cell, *LOOKS[method])
    panel.set_xscale("log")
    panel.set_xlim(TICKS[kind][0], TICKS[kind][-1])
    panel.set_xticks(TICKS[kind])
    panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    panel.xaxis.set_minor_formatter(NullFormatter())
    shares.set_ylim(0.0, MOST_SHARE)
    shares.set_yticks(SHARES)
    shares.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:.0f} %"))
    panel.set_xlabel(f"error margin [{UNITS[kind]}]")
    panel.set_ylabel("seconds to come within it")
    shares.set_ylabel("share remaining", color="#666666")
    if not cells:
        panel.text(0.5, 0.5, "no operators", transform=panel.transAxes, ha="center", color="#666666")


def _draw_curve(panel: Axes, shares: Axes, drawn: Drawn, cell: Cell, color: str, style: Style) -> None:
    curve = drawn.curve
    x = np.array([in_people_units(margin, cell.error) for margin in curve.margins.tolist()])
    is_quick = cell.mode == "quick"
    shares.fill_between(x, curve.share, color=color, alpha=0.035, linewidth=0)
    shares.plot(x, curve.share, color=color, alpha=0.75, linestyle=":", linewidth=0.9 if is_quick else 1.6)
    panel.fill_between(x, curve.low, curve.high, color=color, alpha=0.2, linewidth=0)
    panel.plot(
        x,
        curve.mean,
        color=color,
        linestyle=style,
        linewidth=1.2 if is_quick else 2.0,
        marker="o" if is_quick else None,
        markersize=3,
        markevery=4,
    )


def _legend(cells: Sequence[Cell]) -> Iterator[Line2D | Patch]:
    drawn = {method for cell in cells for method, _ in cell.curves} | {None}
    for method in (method for method in LOOKS if method in drawn):
        color, style = LOOKS[method]
        for mode in dict.fromkeys(cell.mode for cell in cells):
            is_quick = mode == "quick"
            yield Line2D(
                [],
                [],
                color=color,
                linestyle=style,
                linewidth=1.2 if is_quick else 2.0,
                marker="o" if is_quick else None,
                markersize=3,
                label=f"{CURVE_NAMES[method]}, {mode}",
            )
    yield Patch(color="#777777", alpha=0.3, label="95 % interval over operators")
    yield Line2D([], [], color="#777777", linestyle=":", linewidth=1.6, label="share remaining (right axis)")
