/** Sections and tables of reports. */

import { element } from "../dom.js";

/** A part of the page with a heading. */
export function section(title, ...children) {
  const node = element("section", { className: "panel stack" }, element("h2", {}, title), ...children);
  for (const frame of node.querySelectorAll(".table-frame")) frame.setAttribute("aria-label", title);
  return node;
}

/** A table; cells are texts, numbers or elements. */
export function tableOf(names, rows) {
  const head = element("tr", {}, ...names.map((name) => element("th", { scope: "col" }, name)));
  const body = rows.map((row) => element("tr", {}, ...row.map((cell) => element("td", {}, cell instanceof Node ? cell : String(cell)))));
  const table = element("table", {}, element("thead", {}, head), element("tbody", {}, ...body));
  return element("div", { className: "table-frame", tabIndex: 0, role: "group" }, table);
}

/** Leads to the replay of a registration; empty for none. */
export function replayLink(id) {
  return id === null ? "" : element("a", { href: `/replay/${id}` }, `registration ${id}`);
}

/** What was left out or handled, each with its replay. */
export function remarksSection(remarks) {
  const items = remarks.map(({ about, text, registration_id: id }) => {
    const link = replayLink(id);
    return element("li", {}, `${about}: ${text}. `, link);
  });
  return section("What was left out or handled", items.length ? element("ul", {}, ...items) : element("p", {}, "Nothing."));
}
