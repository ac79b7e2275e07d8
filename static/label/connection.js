/** The connection of the 3-D view, which has one of its own beside that of the page. */

import { byId } from "../shared/dom.js";
import { focusView } from "../shared/view.js";

const RETRY_MS = 1000;

/**
 * A part of the labelling page.
 *
 * @param {LabelPage} page
 * @returns {Part}
 */
export function connectionPart(page) {
  let opened = false;
  setInterval(help, RETRY_MS);

  function draw({ view_open: isOpen }) {
    opened ||= isOpen;
    byId("view-lost").hidden = isOpen || !opened;
    help();
  }

  /** The view reconnects only while it has the focus: it gets it, but never from somebody who types. */
  function help() {
    const isTyping = document.activeElement?.matches("input:not([type='range']), dialog *");
    if (!byId("view-lost").hidden && page.isConnected() && document.hasFocus() && !isTyping) focusView();
  }

  return { draw };
}
