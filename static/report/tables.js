/** Sections and tables of reports. */

import { element, icon } from "../shared/dom.js";

/** A part of the page with a heading. */
export function section(title, ...children) {
  const node = element("section", { className: "panel stack" }, element("h2", {}, title), ...children);
  for (const frame of node.querySelectorAll(".table-frame")) frame.setAttribute("aria-label", title);
  return node;
}

/** A table; cells are texts, numbers or elements. A row of one cell is about the row above, and as wide as the table. */
export function tableOf(names, rows) {
  const head = element("tr", {}, ...names.map((name) => element("th", { scope: "col" }, name)));
  const body = rows.map((row) =>
    element("tr", {}, ...row.map((cell) => cellOf(cell, row.length === 1 ? names.length : 1))),
  );
  const table = element("table", {}, element("thead", {}, head), element("tbody", {}, ...body));
  return element("div", { className: "table-frame", tabIndex: 0, role: "group" }, table);
}

function cellOf(content, colSpan) {
  return element("td", { colSpan }, content instanceof Node ? content : String(content));
}

/** A row, and below it what there is to say against it; `text` is empty where there is nothing. */
export function withCaution(row, text) {
  return text ? [row, [element("p", { className: "caution" }, icon("alert"), text)]] : [row];
}

/** Leads to the replay of a registration; empty for none. */
export function replayLink(id) {
  return id === null ? "" : element("a", { href: `/replay/${id}` }, `registration ${id}`);
}

/**
 * What was left out or handled, each with its replay.
 *
 * @param {Rest["RemarkOut"][]} remarks
 */
export function remarksSection(remarks) {
  const items = remarks.map(({ about, text, registration_id: id }) => {
    const link = replayLink(id);
    return element("li", {}, `${about}: ${text}. `, link);
  });
  return section(
    "What was left out or handled",
    items.length ? element("ul", {}, ...items) : element("p", {}, "Nothing."),
  );
}
