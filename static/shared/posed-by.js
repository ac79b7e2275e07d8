/** Whose a pose is, in words and with a sign. */

import { icon } from "./dom.js";

export const POSED_BY = { start: "start pose", human: "posed by hand", machine: "posed by the machine" };

/**
 * Shows it on a badge, with what else there is to say of it.
 *
 * @param {HTMLElement} badge
 * @param {keyof typeof POSED_BY} poser
 */
export function drawPoser(badge, poser, more = "") {
  const text = POSED_BY[poser] + more;
  if (badge.textContent === text) return;
  badge.dataset.source = poser;
  badge.replaceChildren(icon(poser === "start" ? "open" : poser), text);
}
