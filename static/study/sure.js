/** Asks once more before what cannot be taken back. */

import { byId, setText } from "../shared/dom.js";

/**
 * Runs `run` where the person says yes; `question` is {title, text, yes}.
 *
 * @param {{ title: string, text: string, yes: string }} question
 * @param {() => unknown} run
 */
export function askFirst({ title, text, yes }, run) {
  const dialog = byId("sure");
  setText(byId("sure-title"), title);
  setText(byId("sure-text"), text);
  setText(byId("sure-yes"), yes);
  dialog.returnValue = "no";
  dialog.onclose = () => dialog.returnValue === "yes" && run();
  dialog.showModal();
}
