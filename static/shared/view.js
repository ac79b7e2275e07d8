/** The 3-D view: viser in an iframe of the same origin, with its own panel put away. */

import { byId } from "./dom.js";
import { finenessQuery } from "./fineness.js";

const HIDE_VISER_PANEL = ".mantine-Paper-root, .mantine-Notifications-root { display: none !important }";

/**
 * Opens `viewUrl` in the iframe; `onWindow(window)` is called for each document that it loads.
 *
 * @param {string} viewUrl
 * @param {(view: ViewWindow) => void} onWindow
 */
export function openView(viewUrl, onWindow) {
  const frame = byId("view");
  frame.addEventListener("load", () => {
    const view = /** @type {ViewWindow} */ (frame.contentWindow);
    hideViserPanel(view.document);
    onWindow(view);
    frame.classList.add("ready");
    byId("opening").hidden = true;
    if (document.activeElement === document.body) view.focus();
  });
  frame.src = `${viewUrl}?hideViserLogo${finenessQuery()}`;
}

/** viser reconnects only while its own document has the focus. */
export function focusView() {
  byId("view").contentWindow?.focus();
}

/** Takes the view away, and with it its connection. */
export function closeView() {
  byId("view").remove();
}

function hideViserPanel(viewDocument) {
  const style = viewDocument.createElement("style");
  style.textContent = HIDE_VISER_PANEL;
  viewDocument.head.append(style);
}
