/** The order of a study as a table: an operator a column, their tasks from top to bottom. */

import { element } from "../shared/dom.js";

/** `orders` as the server previews them; `nameOf(task)` says what a task asks for. */
export function showOrders(orders, nameOf) {
  const heads = orders.map((_, index) => element("th", { scope: "col" }, `Operator ${index + 1}`));
  const head = element("thead", {}, element("tr", {}, element("th", { scope: "col" }, "#"), ...heads));
  const rows = orders[0].map((_, place) => {
    const cells = orders.map((order) => cell(order, place, nameOf));
    return element("tr", {}, element("th", { scope: "row" }, String(place + 1)), ...cells);
  });
  return element("table", { className: "orders" }, head, element("tbody", {}, ...rows));
}

function cell(order, place, nameOf) {
  const slot = order[place];
  const before = order[place - 1];
  const isNew = !before || blockOf(before) !== blockOf(slot);
  const what = `${slot.is_practice ? "practice, " : ""}${slot.mode}, ${slot.condition}`;
  const block = element("strong", {}, isNew ? what : "");
  return element(
    "td",
    { className: isNew ? "new-block" : "" },
    block,
    isNew ? element("br") : "",
    nameOf(slot.task),
  );
}

const blockOf = ({ is_practice: isPractice, mode, condition }) => `${isPractice} ${mode} ${condition}`;
