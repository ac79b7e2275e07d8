/** Pointing at the scene by a click: in the 3-D view, or in the colour image. */

import { distance, LARGEST_CLICK } from "../shared/click.js";
import { byId } from "../shared/dom.js";

const CROSSHAIR = ".placing canvas { cursor: crosshair !important }";

/**
 * A mode in which clicks point at the scene. `onPoint` gets {across, down} as shares of the 3-D view, or the
 * {frame_id, column, row} of a pixel; so does `onDouble`, by a double click while no such mode is on. Returns
 * `use(on)`, and `attach(window)` for each document of the 3-D view.
 *
 * @param {LabelPage} page
 * @param {(pointed: Rest["ViewPoint"] | Rest["PixelPoint"]) => unknown} onPoint
 * @param {(pointed: Rest["ViewPoint"] | Rest["PixelPoint"]) => unknown} [onDouble]
 */
export function scenePointing(page, onPoint, onDouble = (_pointed) => {}) {
  const image = byId("color");
  const box = /** @type {HTMLElement} */ (image.closest(".image-frame"));
  const roots = new Set([document.documentElement]);
  let on = false;
  let pressedAt = null;

  box.addEventListener("pointerdown", (event) => (pressedAt = event));
  box.addEventListener("click", (event) => {
    if (on && distance(event, pressedAt) <= LARGEST_CLICK) tellPixel(event, onPoint);
  });
  box.addEventListener("dblclick", (event) => isFree() && tellPixel(event, onDouble));

  const isFree = () => !document.documentElement.classList.contains("placing");

  function tellPixel(event, tell) {
    if (event.target.closest("button")) return;
    const { column, row } = pixelAt(image, event);
    if (isInside(image, column, row)) tell({ frame_id: page.registration().frame_id, column, row });
  }

  function use(wanted) {
    if (on === wanted) return;
    on = wanted;
    for (const root of roots) root.classList.toggle("placing", on);
  }

  /** In this mode the left button only points: viser gets the others, and the wheel. */
  function attach(view) {
    const style = view.document.createElement("style");
    style.textContent = CROSSHAIR;
    view.document.head.append(style);
    roots.add(view.document.documentElement);
    const options = { capture: true };
    view.addEventListener(
      "pointerdown",
      (event) => on && event.button === 0 && event.stopPropagation(),
      options,
    );
    view.addEventListener(
      "click",
      (event) => {
        if (!on) return;
        event.stopPropagation();
        onPoint(placeInView(view, event));
      },
      options,
    );
    view.addEventListener("dblclick", (event) => isFree() && onDouble(placeInView(view, event)), options);
  }

  return { use, attach };
}

function placeInView(view, { clientX, clientY }) {
  return { across: clientX / view.innerWidth, down: clientY / view.innerHeight };
}

/**
 * The page's {x, y} of a pixel of the image, however it is scaled or shifted.
 *
 * @param {HTMLImageElement} image
 * @param {number} column
 * @param {number} row
 */
export function placeOfPixel(image, column, row) {
  const { scale, left, top } = shownAt(image);
  return { x: left + (column + 0.5) * scale, y: top + (row + 0.5) * scale };
}

function pixelAt(image, { clientX, clientY }) {
  const { scale, left, top } = shownAt(image);
  return { column: (clientX - left) / scale - 0.5, row: (clientY - top) / scale - 0.5 };
}

function isInside({ naturalWidth: width, naturalHeight: height }, column, row) {
  return column >= -0.5 && row >= -0.5 && column <= width - 0.5 && row <= height - 0.5;
}

/** How the image is shown: page pixels to one of its own, and where on the page its corner lies. */
function shownAt(image) {
  const box = image.getBoundingClientRect();
  const { naturalWidth: width, naturalHeight: height } = image;
  const scale = Math.min(box.width / width, box.height / height);
  return {
    scale,
    left: box.left + (box.width - width * scale) / 2,
    top: box.top + (box.height - height * scale) / 2,
  };
}
