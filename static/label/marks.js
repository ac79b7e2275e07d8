/** Numbered marks over a picture. */

import { element } from "../shared/dom.js";

/**
 * Numbers {x, y, isHidden} [page pixels from the corner of `layer`] from 1 on, in place of the marks before.
 *
 * @param {HTMLElement} layer
 * @param {(Place & { isHidden: boolean })[]} places
 */
export function drawMarks(layer, places) {
  while (layer.children.length > places.length) layer.lastElementChild?.remove();
  places.forEach(({ x, y, isHidden }, index) => {
    const mark =
      /** @type {HTMLElement} */ (layer.children[index]) ??
      layer.appendChild(element("span", {}, `${index + 1}`));
    mark.style.translate = `${x}px ${y}px`;
    mark.classList.toggle("behind", isHidden);
  });
}
