/** The colour image of the frame, with the outline of the object or its shape on top; zoom; choice of frame. */

import { put } from "../api.js";
import { byId, setText } from "../dom.js";
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
  let frames = [];
  let shown = null; // the frame
  let view = null;
  let mesh = null;
  let drawMesh = null;
  let T = null;
  let waiting = 0;

  image.addEventListener("load", () => (image.hidden = false));
  image.addEventListener("error", () => (image.hidden = true));
  blend.addEventListener("input", drawSoon);
  byId("frame-previous").addEventListener("click", () => step(-1));
  byId("frame-next").addEventListener("click", () => step(+1));
  byId("zoom-in").addEventListener("click", zoom.zoomIn);
  byId("zoom-out").addEventListener("click", zoom.zoomOut);
  byId("zoom-fit").addEventListener("click", fitOrWhole);
  byId("hide-outline").addEventListener("click", hideOrShow);

  const indexOf = (frame) => frames.indexOf(frame);
  const beside = (by) => frames[indexOf(shown) + by] ?? null;

  function open(_task, scene, object) {
    frames = scene.frames;
    byId("frames").hidden = frames.length < 2;
    showMesh(object).catch(page.message.problem);
  }

  async function showMesh(object) {
    mesh = await loadMesh(object.outline_mesh_url);
    drawMesh = meshDrawing(mesh);
    byId("no-outline").hidden = drawMesh !== null;
    drawSoon();
  }

  async function step(by) {
    const frame = beside(by);
    if (!frame || !page.isConnected()) return;
    await put(page.path("frame"), { frame_id: frame.id }).catch(page.message.problem);
  }

  function draw({ frame_id: frameId, T_camera_object, confidence }) {
    const frame = frames.find(({ id }) => id === frameId);
    if (!frame) return;
    if (shown !== frame) showFrame(frame);
    T = T_camera_object;
    canvas.dataset.source = confidence === null ? "human" : "machine";
    drawSoon();
  }

  function showFrame(frame) {
    shown = frame;
    if (frame.color_url) image.src = frame.color_url;
    else image.hidden = true;
    zoom.setSize(frame.width, frame.height);
    const place = frames.length > 1 ? ` (${indexOf(frame) + 1} of ${frames.length})` : "";
    setText(byId("frame-name"), `Frame ${frame.image_id}${place}`);
    byId("frame-previous").disabled = beside(-1) === null;
    byId("frame-next").disabled = beside(+1) === null;
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
    if (!drawMesh || !T || canvas.hidden) return;
    const unit = Math.min(devicePixelRatio, 2);
    resize(canvas, Math.round(box.clientWidth * unit), Math.round(box.clientHeight * unit));
    const { scale, left, top } = view;
    const camera = shownCamera(shown.intrinsics, { scale: scale * unit, left: left * unit, top: top * unit });
    drawMesh(canvas, { camera, T, color: colorOf(canvas), blend: blend.valueAsNumber, unit });
  }

  function fitOrWhole() {
    if (!zoom.isWhole()) zoom.whole();
    else if (mesh && T) {
      const extent = extentInPicture(mesh, T, shown.intrinsics);
      if (extent) zoom.fit(extent);
      else page.message.show("The object is behind the camera of this frame.");
    }
  }

  function hideOrShow() {
    canvas.hidden = !canvas.hidden;
    setText(byId("hide-outline-text"), canvas.hidden ? "Show outline" : "Hide outline");
    drawSoon();
  }

  const bindings = [
    { keys: [","], does: "Previous frame", run: () => step(-1) },
    { keys: ["."], does: "Next frame", run: () => step(+1) },
    { keys: ["Z"], does: "Zoom the image to the object, and back to all of it", run: fitOrWhole },
    { keys: ["O"], does: "Hide the outline on the image, and show it again", run: hideOrShow },
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
