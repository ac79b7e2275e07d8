/** Looking at the object from elsewhere. */

import { post } from "../shared/api.js";
import { byId } from "../shared/dom.js";

/**
 * A part of the labelling page; the view's element is told by the event `looked`.
 *
 * @param {LabelPage} page
 * @returns {Part}
 */
export function viewsPart(page) {
  const buttons = /** @type {HTMLButtonElement[]} */ ([...document.querySelectorAll("[data-look]")]);
  let asked = false;
  for (const button of buttons) button.addEventListener("click", () => look(button.dataset.look));

  const canLook = () => page.isConnected() && page.registration()?.dragging === false;

  async function look(at) {
    if (asked || !canLook()) return;
    asked = true;
    try {
      await post(page.path("look"), { at });
      byId("view")?.dispatchEvent(new Event("looked"));
    } catch (error) {
      page.message.problem(error);
    } finally {
      asked = false;
    }
  }

  function draw() {
    for (const button of buttons) button.disabled = !canLook();
  }

  const bindings = [
    { keys: ["4"], does: "Look at the object, closer", run: () => look("object") },
    { keys: ["5"], does: "Look as the sensor did", run: () => look("sensor") },
    { keys: ["6"], does: "Look from the top", run: () => look("top") },
    { keys: ["7"], does: "Look from the front", run: () => look("front") },
    { keys: ["8"], does: "Look from the side", run: () => look("side") },
    { keys: ["9"], does: "Go around the object, to the left", run: () => look("left"), repeats: true },
    { keys: ["0"], does: "Go around the object, to the right", run: () => look("right"), repeats: true },
  ];
  return { title: "The view", bindings, draw };
}
