/** What a plan amounts to: tasks, minutes and operators, and whether its order is balanced. */

import { element } from "../shared/dom.js";
import { count } from "../shared/format.js";

const MINUTES_AN_HOUR = 60;

/**
 * Entries of a <dl>, of a plan and of what the server previews of it.
 *
 * @param {Required<Rest["StudyPlan"]>} plan
 * @param {Rest["PreviewOut"]} preview
 */
export function amountsOf({ groups, modes, conditions, tasks, practice }, { minutes }) {
  const counting = tasks.length * modes.length * conditions.length;
  const trying = practice.length * conditions.length;
  const operators = sum(Object.values(groups));
  const each = trying ? `${counting} + ${trying} practice` : `${counting}`;
  return [
    entry("Tasks each", each),
    entry("Time each, about", duration(minutes)),
    entry("Participants", `${operators}`),
    entry("Time in all, about", duration(minutes * operators)),
  ];
}

/**
 * What the times assume, and how the order is balanced.
 *
 * @param {{ groups: Record<string, number> }} plan
 * @param {Rest["PreviewOut"]} preview
 */
export function noteOn({ groups }, { rows_of_balance: rows, orders, minutes_a_task: assumed }) {
  const uneven = Object.entries(groups)
    .filter(([, size]) => size % rows)
    .map(([name]) => name);
  const times = Object.entries(assumed).map(([mode, each]) => `${each} min for a task in “${mode}”`);
  const balance = uneven.length
    ? `For an even balance groups need a multiple of ${count(rows, "participant")}; that is not so for ${uneven.join(", ")}.`
    : "The order is balanced evenly.";
  const isCut = Math.max(...Object.values(groups)) > orders.length;
  const shown = isCut ? ` Shown are the first ${orders.length}; the others follow in the same way.` : "";
  return {
    time: `Times assume ${times.join(" and ")}, breaks and reading not counted: try it yourself first.`,
    order: `${balance} Operator 1 is the first one of each group, and so on.${shown}`,
  };
}

function entry(name, value) {
  return element("div", {}, element("dt", {}, name), element("dd", {}, value));
}

function duration(minutes) {
  if (minutes < 2 * MINUTES_AN_HOUR) return `${Math.round(minutes)} min`;
  return `${Number((minutes / MINUTES_AN_HOUR).toPrecision(2))} h`;
}

const sum = (numbers) => numbers.reduce((total, number) => total + number, 0);
