/** The frames of the scene as a strip of thumbnails, with the object's outline in each. */

import { byId, element, picture, setText } from "../dom.js";
import { shownCamera } from "./outline.js";
import { relativeTo } from "./pose.js";
import { resize } from "./webgl.js";

const LINE_WIDTH = 0.7; // of the outline, as a share of that on the large image
const DRAG_PAUSE = 200; // ms between thumbnails while all the time belongs to the large image

/**
 * Makes the strip; `choose(frame)` is called with the frame that is asked for.
 *
 * @param {(frame: Rest["FrameOut"]) => unknown} choose
 */
export function frameStrip(choose) {
  const stale = new Set();
  const visible = new Set();
  const watcher = new IntersectionObserver(noteVisible, { root: byId("frame-list") });
  let thumbnails = [];
  let shown = null;
  let drawn = null;
  let waiting = 0;
  byId("frame-previous").addEventListener("click", () => step(-1));
  byId("frame-next").addEventListener("click", () => step(+1));

  const beside = (by) => thumbnails[thumbnails.indexOf(shown) + by]?.frame ?? null;

  function open(frames) {
    thumbnails = frames.map((frame) => thumbnail(frame, choose));
    byId("strip").hidden = frames.length < 2;
    byId("frame-list").replaceChildren(...thumbnails.map(({ item }) => item));
    for (const { item } of thumbnails) watcher.observe(item);
  }

  /** Marks the frame that is shown large. */
  function mark(frame) {
    shown?.button.removeAttribute("aria-current");
    shown = thumbnails.find((one) => one.frame === frame);
    shown.button.setAttribute("aria-current", "true");
    shown.item.scrollIntoView({ block: "nearest", inline: "nearest" });
    setText(byId("frame-name"), `Frame ${frame.image_id}`);
    setText(byId("frame-place"), `${thumbnails.indexOf(shown) + 1} of ${thumbnails.length}`);
    byId("frame-previous").disabled = beside(-1) === null;
    byId("frame-next").disabled = beside(+1) === null;
  }

  function step(by) {
    const frame = beside(by);
    if (frame) choose(frame);
  }

  /** Draws {drawOn, T_world_object, color, dragging} into the thumbnails that can be seen, and later into the others. */
  function draw(newlyDrawn) {
    drawn = newlyDrawn;
    for (const one of thumbnails) stale.add(one);
    drawNext();
  }

  /** One thumbnail to a picture of the screen, so that many never hold up a drag. */
  function drawNext() {
    const next = [...stale].find((one) => visible.has(one.item));
    if (!next || waiting) return;
    waiting = setTimeout(
      () =>
        requestAnimationFrame(() => {
          waiting = 0;
          stale.delete(next);
          drawInto(next, drawn);
          drawNext();
        }),
      drawn.dragging ? DRAG_PAUSE : 0,
    );
  }

  function noteVisible(entries) {
    for (const { target, isIntersecting } of entries) visible[isIntersecting ? "add" : "delete"](target);
    drawNext();
  }

  return { open, mark, step, draw };
}

function thumbnail(frame, choose) {
  const canvas = element("canvas", { "aria-hidden": "true" });
  const image = picture(frame.color_url, "thumbnail", { lazy: true });
  image.style.aspectRatio = `${frame.width} / ${frame.height}`;
  image.append(canvas);
  const name = `Frame ${frame.image_id}`;
  const button = element(
    "button",
    { type: "button", title: name, "aria-label": `Show frame ${frame.image_id}` },
    image,
  );
  button.addEventListener("click", () => choose(frame));
  return { frame, canvas, button, item: element("li", {}, button) };
}

function drawInto({ frame, canvas }, { drawOn, T_world_object, color }) {
  const unit = Math.min(devicePixelRatio, 2);
  resize(canvas, Math.round(canvas.clientWidth * unit), Math.round(canvas.clientHeight * unit));
  const camera = shownCamera(frame.intrinsics, { scale: canvas.width / frame.width, left: 0, top: 0 });
  const T = relativeTo(frame.T_world_camera, T_world_object);
  drawOn(canvas, { camera, T, color, blend: 0, unit: LINE_WIDTH * unit });
}
