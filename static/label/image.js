/** The colour image of the frame, with the outline of the object or its shape on top; zoom; the other frames. */

import { byId, setText } from "../dom.js";
import { frameStrip } from "./frames.js";
import { extentInPicture, loadMesh, meshDrawing, shownCamera } from "./outline.js";
import { zoomable } from "./zoom.js";

const CLOSE = 2.5; // page pixels to one of the picture from which on these are shown as squares

/** A part of the labelling page. */
export function imagePart(page) {
  const box = byId("image");
  const image = byId("color");
  const canvas = byId("outline");
  const blend = byId("blend");
  const zoom = zoomable(box, showView);
  const strip = frameStrip(chooseFrame);
  let frames = [];
  let shown = null; // the frame
  let view = null;
  let mesh = null;
  let drawMesh = null;
  let registration = null;
  let waiting = 0;

  image.addEventListener("load", () => (image.hidden = false));
  image.addEventListener("error", () => (image.hidden = true));
  blend.addEventListener("input", drawSoon);
  byId("zoom-in").addEventListener("click", zoom.zoomIn);
  byId("zoom-out").addEventListener("click", zoom.zoomOut);
  byId("zoom-fit").addEventListener("click", fitOrWhole);
  byId("hide-outline").addEventListener("click", hideOrShow);

  function open(_task, scene, object) {
    frames = scene.frames;
    strip.open(frames);
    showMesh(object).catch(page.message.problem);
  }

  async function showMesh(object) {
    mesh = await loadMesh(object.outline_mesh_url);
    drawMesh = meshDrawing(mesh);
    byId("no-outline").hidden = drawMesh !== null;
    drawPose();
  }

  async function chooseFrame(frame) {
    if (frame === shown || !page.isConnected()) return;
    await page.showFrame(frame).catch(page.message.problem);
  }

  function draw(newest) {
    const frame = frames.find(({ id }) => id === newest.frame_id);
    if (!frame) return;
    registration = newest;
    if (shown !== frame) showFrame(frame);
    canvas.dataset.source = newest.confidence === null ? "human" : "machine";
    drawPose();
  }

  function showFrame(frame) {
    shown = frame;
    if (frame.color_url) image.src = frame.color_url;
    else image.hidden = true;
    zoom.setSize(frame.width, frame.height);
    strip.mark(frame);
  }

  function showView(newView) {
    view = newView;
    image.style.transform = `translate(${view.left}px, ${view.top}px) scale(${view.scale})`;
    image.classList.toggle("close", view.scale > CLOSE);
    setText(byId("zoom-fit-text"), zoom.isWhole() ? "Fit" : "Whole");
    drawSoon();
  }

  /** Draws at the next picture of the screen, however much changes until then. */
  function drawSoon() {
    waiting ||= requestAnimationFrame(drawOutline);
  }

  function drawOutline() {
    waiting = 0;
    if (!drawMesh || !registration || canvas.hidden) return;
    const { T_camera_object: T } = registration;
    const unit = Math.min(devicePixelRatio, 2);
    resize(canvas, Math.round(box.clientWidth * unit), Math.round(box.clientHeight * unit));
    const { scale, left, top } = view;
    const camera = shownCamera(shown.intrinsics, { scale: scale * unit, left: left * unit, top: top * unit });
    drawMesh(canvas, { camera, T, color: colorOf(canvas), blend: blend.valueAsNumber, unit });
  }

  /** Draws the object where it is now, here and in the thumbnails. */
  function drawPose() {
    drawSoon();
    if (drawMesh && registration) {
      strip.draw({ drawMesh, T_world_object: registration.T_world_object, color: colorOf(canvas) });
    }
  }

  function fitOrWhole() {
    if (!zoom.isWhole()) zoom.whole();
    else if (mesh && registration) {
      const extent = extentInPicture(mesh, registration.T_camera_object, shown.intrinsics);
      if (extent) zoom.fit(extent);
      else page.message.show("The object is behind the camera of this frame.");
    }
  }

  function hideOrShow() {
    canvas.hidden = !canvas.hidden;
    byId("frame-list").classList.toggle("bare", canvas.hidden);
    setText(byId("hide-outline-text"), canvas.hidden ? "Show outline" : "Hide outline");
    drawSoon();
  }

  const bindings = [
    { keys: [","], does: "Previous frame", run: () => strip.step(-1) },
    { keys: ["."], does: "Next frame", run: () => strip.step(+1) },
    { keys: ["Z"], does: "Zoom the image to the object, and back to all of it", run: fitOrWhole },
    { keys: ["H"], does: "Hide the outline on the image, and show it again", run: hideOrShow },
  ];
  return { bindings, open, draw };
}

/** Gives a canvas a size in pixels; only where it changes, since that wipes it. */
function resize(canvas, width, height) {
  if (canvas.width !== width) canvas.width = width;
  if (canvas.height !== height) canvas.height = height;
}

/** The colour of an element as [red, green, blue] from 0 to 1. */
function colorOf(node) {
  const [red, green, blue] = getComputedStyle(node).color.match(/[\d.]+/g);
  return [red / 255, green / 255, blue / 255];
}
