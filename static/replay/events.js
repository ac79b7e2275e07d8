/** The list of events, and going from one to the next. */

import { byId, element, icon } from "../shared/dom.js";
import { framesText, METHODS } from "../shared/format.js";
import { clockText } from "./clock.js";

const WORDS = {
  opened: "Opened",
  drag: "Drag",
  set_pose: "Pose set",
  frame: "Another frame",
  snap_requested: "Snap requested",
  snap_applied: "Snap applied",
  snap_offered: "Snap offered",
  snap_cancelled: "Snap cancelled",
  snap_failed: "Snap failed",
  live: "Live on or off",
  accept: "Accepted",
  dismiss: "Dismissed",
  undo: "Undo",
  redo: "Redo",
  reset: "Reset",
  submit: "Submitted",
};
const BARELY = 0.001; // seconds

/**
 * Fills the list; `choose(seconds)` is called with the time of an event that is asked for.
 *
 * @param {Rest["TraceOut"]} trace
 * @param {(seconds: number) => void} choose
 */
export function eventList(trace, choose) {
  const events = trace.events.filter(({ kind }) => kind !== "view");
  const rows = events.map((event) => row(event, choose));
  let current = null;
  byId("events").replaceChildren(...rows);

  /** Marks what happened last at a time. */
  function mark(seconds) {
    const index = lastUpTo(seconds);
    if (rows[index] === current) return;
    current?.removeAttribute("aria-current");
    current = rows[index] ?? null;
    current?.setAttribute("aria-current", "true");
    current?.scrollIntoView({ block: "nearest" });
  }

  function lastUpTo(seconds) {
    let [low, high] = [0, events.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (events[middle].end <= seconds + BARELY) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  }

  const next = (seconds) => events[lastUpTo(seconds) + 1];
  const previous = (seconds) => events[lastUpTo(seconds - 2 * BARELY)];
  return { mark, next, previous };
}

function row(event, choose) {
  const actor = event.actor === "machine" ? "machine" : "human";
  const time = element("span", { className: "event-time" }, clockText(event.end));
  const button = element(
    "button",
    { type: "button" },
    time,
    icon(actor),
    element("span", {}, sentence(event)),
  );
  button.dataset.actor = actor;
  button.addEventListener("click", () => choose(event.end));
  return element("li", {}, button);
}

/** "Drag · tx, rz · 1.2 s", "Snap applied · fast · 0.97 · 0.1 s". */
function sentence({ kind, start, end, dof, technique, verdict, method, frames, confidence }) {
  const parts = [WORDS[kind] ?? kind.replaceAll("_", " ")];
  if (technique) parts.push(technique);
  if (method) parts.push(METHODS[method].name);
  if (kind === "drag" && dof) parts.push(dof.join(", "));
  if (framesText(frames)) parts.push(framesText(frames));
  if (confidence !== null) parts.push(confidence.toFixed(2));
  if (verdict) parts.push(verdict);
  if (end - start >= 0.05) parts.push(`${(end - start).toFixed(1)} s`);
  return parts.join(" · ");
}
