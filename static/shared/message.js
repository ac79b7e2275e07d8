/** A message area: one sentence at a time, calm, with at most one action. */

import { element, icon } from "./dom.js";

const ICONS = { problem: "alert", good: "check", info: "info" };

/**
 * Turns `container` (an empty element with a live-region role) into a message area.
 *
 * @param {HTMLElement} container
 * @returns {Message}
 */
export function messageArea(container) {
  const clear = () => {
    container.hidden = true;
    container.replaceChildren();
  };
  container.classList.add("message");
  clear();

  /** @type {Message["show"]} */
  const show = (text, kind = "info", action = null) => {
    const close = element("button", { type: "button", className: "button quiet square" }, icon("close"));
    close.setAttribute("aria-label", "Close message");
    close.addEventListener("click", clear);
    container.dataset.kind = kind;
    container.hidden = false;
    container.replaceChildren(icon(ICONS[kind]), element("p", {}, text), close);
    if (action) {
      const props = { type: "button", className: "button action", onclick: action.run };
      container.append(element("button", props, action.label));
    }
  };

  return { show, clear, problem: (error, action = null) => show(error.message, "problem", action) };
}
