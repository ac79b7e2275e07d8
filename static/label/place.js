/** Placing the object by a double click on the cloud or the colour image, or by a click after a key. */

import { post } from "../api.js";
import { byId } from "../dom.js";

/** Pixels; a pointer that moved farther has dragged the image. */
const LARGEST_CLICK = 4;
const CROSSHAIR = ".placing canvas { cursor: crosshair !important }";

/** A part of the labelling page. */
export function placePart(page) {
  const button = byId("place");
  const image = byId("color");
  let roots = [document.documentElement];
  let on = false;
  let pressedAt = null;

  button.addEventListener("click", () => use(!on));
  byId("place-leave").addEventListener("click", leave);
  const frame = image.closest(".image-frame");
  frame.addEventListener("pointerdown", (event) => (pressedAt = event));
  frame.addEventListener("click", (event) => {
    if (!on || isDrag(event) || event.target.closest("button")) return;
    placeInImage(event);
  });
  frame.addEventListener("dblclick", (event) => {
    if (page.canMove() && !event.target.closest("button")) placeInImage(event);
  });

  function placeInImage(event) {
    const pixel = pixelAt(event);
    if (pixel) place(pixel);
  }

  const isDrag = ({ clientX, clientY }) =>
    Math.hypot(clientX - pressedAt.clientX, clientY - pressedAt.clientY) > LARGEST_CLICK;

  function use(wanted) {
    on = wanted && page.canMove();
    button.setAttribute("aria-pressed", on);
    byId("place-mode").hidden = !on;
    for (const root of roots) root.classList.toggle("placing", on);
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
      await post(page.path("place"), point);
      leave();
    } catch (error) {
      page.message.problem(error);
    }
  }

  /** In this mode the left button only points: viser gets the others, and the wheel. */
  function attach(view) {
    const style = view.document.createElement("style");
    style.textContent = CROSSHAIR;
    view.document.head.append(style);
    roots = [document.documentElement, view.document.documentElement];
    const options = { capture: true };
    view.addEventListener("pointerdown", (event) => on && event.button === 0 && event.stopPropagation(), options);
    view.addEventListener(
      "click",
      (event) => {
        if (!on) return;
        event.stopPropagation();
        placeInView(event);
      },
      options,
    );
    view.addEventListener("dblclick", (event) => page.canMove() && placeInView(event), options);

    function placeInView({ clientX, clientY }) {
      place({ across: clientX / view.innerWidth, down: clientY / view.innerHeight });
    }
  }

  /** The frame's pixel under the pointer, or null beside the picture, however it is scaled or shifted. */
  function pixelAt({ clientX, clientY }) {
    const box = image.getBoundingClientRect();
    const { naturalWidth: width, naturalHeight: height } = image;
    const scale = Math.min(box.width / width, box.height / height);
    const column = (clientX - box.left - (box.width - width * scale) / 2) / scale - 0.5;
    const row = (clientY - box.top - (box.height - height * scale) / 2) / scale - 0.5;
    const inside = column >= -0.5 && row >= -0.5 && column <= width - 0.5 && row <= height - 0.5;
    return inside ? { frame_id: page.registration().frame_id, column, row } : null;
  }

  function draw() {
    button.disabled = !page.canMove();
    if (!page.canMove()) leave();
  }

  const bindings = [{ keys: ["P"], does: "Place the object by a click; Esc leaves this", run: () => use(!on) }];
  return { title: "The object", bindings, attach, leave, draw };
}
