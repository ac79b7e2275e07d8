/** Placing the object by a double click on the cloud or the colour image, or by a click after a key. */

import { byId } from "../shared/dom.js";
import { scenePointing } from "./pointing.js";

/**
 * A part of the labelling page.
 *
 * @param {LabelPage} page
 * @returns {Part}
 */
export function placePart(page) {
  const button = byId("place");
  const pointing = scenePointing(page, place, (point) => canPlace() && place(point));
  let on = false;

  const canPlace = () => page.canMove() && page.has("click-to-place");
  button.addEventListener("click", () => use(!on));
  byId("place-leave").addEventListener("click", leave);

  function use(wanted) {
    if (wanted) page.leaveMode();
    on = wanted && page.canMove();
    button.setAttribute("aria-pressed", on);
    byId("place-mode").hidden = !on;
    pointing.use(on);
  }

  /** True if there was something to leave. */
  function leave() {
    const was = on;
    use(false);
    return was;
  }

  /** Where a pointing is refused, the mode stays for another try. */
  async function place(point) {
    page.message.clear();
    try {
      await page.post("place", point);
      leave();
    } catch (error) {
      page.message.problem(error);
    }
  }

  function draw() {
    button.disabled = !page.canMove();
    if (!page.canMove()) leave();
  }

  const bindings = [
    {
      keys: ["P"],
      does: "Place the object by a click; Esc leaves this",
      run: () => use(!on),
      tool: "click-to-place",
    },
  ];
  return { title: "The object", bindings, attach: pointing.attach, leave, draw };
}
