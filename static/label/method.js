/** What Snap computes with; put away where the task's condition leaves no choice. */

import { byId } from "../shared/dom.js";
import { METHODS } from "../shared/format.js";

/**
 * A part of the labelling page.
 *
 * @param {LabelPage} page
 * @returns {Part}
 */
export function methodPart(page) {
  const choice = byId("method");
  choice.addEventListener("change", choose);

  async function choose() {
    choice.blur(); // so that Space snaps
    try {
      await page.put("method", { method: /** @type {Registration["method"]} */ (choice.value) });
    } catch (error) {
      choice.value = page.registration().method;
      page.message.problem(error);
    }
  }

  function draw({ method, methods, state }) {
    if (choice.childElementCount === 0)
      choice.append(...methods.map((name) => new Option(METHODS[name].choice, name)));
    choice.value = method;
    choice.disabled = !page.isConnected();
    byId("method-choice").hidden = methods.length < 2 || state !== "open";
  }

  return { draw };
}
