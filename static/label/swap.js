/** The image large in the place of the 3-D view, and the view small in that of the image. */

import { byId, setText } from "../shared/dom.js";

/**
 * A part of the labelling page.
 *
 * @returns {Part}
 */
export function swapPart() {
  const main = document.querySelectorAll("main")[0];
  byId("swap").addEventListener("click", swap);

  function swap() {
    const isLarge = main.classList.toggle("swapped");
    byId("swap").setAttribute("aria-pressed", isLarge);
    setText(byId("swap-text"), isLarge ? "Reduce" : "Enlarge");
  }

  const bindings = [
    { keys: ["Shift+Z"], does: "Enlarge the image in place of the 3-D view, and back", run: swap },
  ];
  return { title: "Image and frames", bindings };
}
