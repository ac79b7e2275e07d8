/**
 * The ring of the focus around the 3-D view. No style sheet can tell that an iframe has the focus, nor whether it
 * came by a key.
 */

import { byId } from "../shared/dom.js";

/**
 * A part of the labelling page.
 *
 * @returns {Part}
 */
export function viewRingPart() {
  let byKey = false;
  follow(window);
  for (const change of ["blur", "focus"]) addEventListener(change, show);

  function follow(target) {
    const capture = { capture: true };
    target.addEventListener("keydown", () => (byKey = true), capture);
    target.addEventListener("pointerdown", showForPointer, capture);
  }

  function showForPointer() {
    byKey = false;
    show();
  }

  function show() {
    const view = byId("view");
    view?.parentElement?.classList.toggle("ringed", byKey && document.activeElement === view);
  }

  return { attach: follow };
}
