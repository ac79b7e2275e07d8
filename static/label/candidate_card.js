/** A pose to choose, as a picture: a piece of the colour image with the object's outline drawn in. */

import { element, rgb } from "../shared/dom.js";
import { extentInPicture, shownCamera } from "../shared/drawing/outline.js";

const FILLED = 0.62; // share of the picture that the object takes, so that its surroundings are seen
const LINE_WIDTH = 0.7; // of the outline, as a share of that on the large image

/** Makes the card of {T_camera_object, T_world_object, chance}; `choose` and `take` are called with its place. */
export function candidateCard(candidate, index, frame, { choose, take }) {
  const chance = candidate.chance === null ? "" : `${Math.round(100 * candidate.chance)} %`;
  const canvas = element("canvas", { "aria-hidden": "true" });
  const image = element("img", { alt: "", draggable: false });
  if (frame.color_url) image.src = frame.color_url;
  const button = element(
    "button",
    {
      type: "button",
      "aria-pressed": "false",
      "aria-label": [`Candidate ${index + 1}`, chance].filter(Boolean).join(", "),
    },
    element("span", { className: "crop" }, image, canvas),
    element("span", { className: "caption" }, element("strong", {}, index + 1), element("span", {}, chance)),
  );
  button.addEventListener("click", () => choose(index));
  button.addEventListener("dblclick", () => take(index));
  button.addEventListener("keydown", (event) => {
    if (event.key !== "Enter") return;
    event.preventDefault();
    take(index);
  });
  return { ...candidate, frame, canvas, image, button, item: element("li", {}, button) };
}

/** Draws a card that is on the page. */
export function drawCard({ T_camera_object: T, frame, canvas, image }, { mesh, drawOn, blend }) {
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const all = { left: 0, top: 0, right: frame.width, bottom: frame.height };
  const view = around(extentInPicture(mesh, T, frame.intrinsics) ?? all, width, height);
  image.style.transform = `translate(${view.left}px, ${view.top}px) scale(${view.scale})`;
  if (!drawOn) return;
  const unit = Math.min(devicePixelRatio, 2);
  canvas.width = Math.round(width * unit);
  canvas.height = Math.round(height * unit);
  const { scale, left, top } = view;
  const camera = shownCamera(frame.intrinsics, { scale: scale * unit, left: left * unit, top: top * unit });
  drawOn(canvas, { camera, T, color: rgb(getComputedStyle(canvas).color), blend, unit: LINE_WIDTH * unit });
}

/** How to show the picture so that a box of it lies in the middle: {scale, left, top}, page pixels. */
function around({ left, top, right, bottom }, width, height) {
  const scale = FILLED * Math.min(width / (right - left), height / (bottom - top));
  return {
    scale,
    left: width / 2 - (scale * (left + right)) / 2,
    top: height / 2 - (scale * (top + bottom)) / 2,
  };
}
