/** The curves of a report: charts with their legend, and the same as a table. */

import { byId, element } from "../shared/dom.js";
import { chart, legendEntry } from "./chart.js";
import { digits, inPeopleUnits, secondsText, shareText, unitOf } from "./numbers.js";
import { replayLink, section, tableOf } from "./tables.js";

/** Draws a chart for each group and error of the cells; `names` are what the lines of a cell are called. */
export function drawPanels(cells, names, { errors, isSimulated }) {
  const shown = cells.filter(({ error }) => errors.includes(error));
  const keys = [...new Map(shown.map((cell) => [`${cell.group}, ${cell.error}`, cell])).entries()];
  const seriesWhere = (isMeant) => shown.filter(isMeant).flatMap((cell) => seriesOf(cell, names));
  const panels = keys.map(([title, { group, error }]) => {
    const compared = seriesWhere((cell) => cell.error === error); // groups are read off one scale
    const series = seriesWhere((cell) => cell.group === group && cell.error === error);
    return chart(isSimulated ? `${title} · simulated` : title, error, series, compared);
  });
  byId("panels").replaceChildren(
    ...(panels.length ? panels : [element("p", { className: "panel" }, "There are no trials to show.")]),
  );
  const legend = new Map(shown.flatMap((cell) => seriesOf(cell, names)).map((one) => [one.name, one]));
  byId("legend").replaceChildren(
    ...[...legend.values()].map(legendEntry),
    element("li", { className: "muted" }, "band: 95 % interval; dotted: share remaining (right)"),
  );
}

/** All numbers of the curves, for whoever cannot see them. */
export function curvesSection(cells, names, { errors }) {
  const rows = cells
    .filter(({ error }) => errors.includes(error))
    .flatMap((cell) =>
      seriesOf(cell, names).flatMap((one) => one.points.map((point) => pointRow(cell, one, point))),
    );
  const head = [
    "group",
    "curve",
    "within",
    "seconds",
    "95 % interval",
    "operators",
    "trials",
    "remaining",
    "replay",
  ];
  const details = element("details", {}, element("summary", {}, "Show the table"), tableOf(head, rows));
  return section("The curves as a table", details);
}

function pointRow({ group, error }, { name }, { margin, seconds, low, high, operators, trials, share, id }) {
  const interval = low === null ? "–" : `${secondsText(low)} to ${secondsText(high)}`;
  const within = `${digits(margin)} ${unitOf(error)}`;
  return [
    group,
    name,
    within,
    secondsText(seconds),
    interval,
    operators,
    trials,
    shareText(share),
    replayLink(id),
  ];
}

/** The human's line, and those of the snaps by method: {hand, points, fitts}; `hand` is "human", "default" or "paper". */
export function linesOf({ human, stg }) {
  return [
    { hand: "human", ...human },
    ...Object.entries(stg).map(([method, line]) => ({ hand: method, ...line })),
  ];
}

function seriesOf(cell, names) {
  return linesOf(cell).map(({ hand, points }) => ({
    name: [names[hand], cell.mode, cell.condition === "manual" ? null : cell.condition]
      .filter(Boolean)
      .join(", "),
    hand,
    mode: cell.mode,
    points: points.map(({ registration_id: id, ...point }) => ({
      ...point,
      id,
      margin: inPeopleUnits(point.margin, cell.error),
    })),
  }));
}
