/** The colour image of the frame, with the outline of the object or its shape on top; zoom; the other frames. */

import { byId, rgb, setText } from "../dom.js";
import { depthOf } from "./depth.js";
import { frameStrip } from "./frames.js";
import { extentInPicture, meshDrawing, sharedDrawing, shownCamera } from "./outline.js";
import { relativeTo } from "./pose.js";
import { resize } from "./webgl.js";
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
  let drawOn = null; // the thumbnails
  let depth = null; // where its agreement is to be seen
  let registration = null;
  let isWaiting = false; // for the next picture of the screen
  const boxSize = { width: 0, height: 0 };
  const colors = {};

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
    ({ mesh, drawOn } = await sharedDrawing(object.outline_mesh_url));
    drawMesh = meshDrawing(canvas, mesh);
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
    registration = newest.preview ? asLookedAt(newest, frame) : newest;
    if (shown !== frame) showFrame(frame);
    canvas.dataset.source = newest.preview || newest.posed_by === "machine" ? "machine" : "human";
    showAgreement(newest.layers?.agreement);
    drawPose();
  }

  function showFrame(frame) {
    shown = frame;
    if (frame.color_url) image.src = frame.color_url;
    else image.hidden = true;
    zoom.setSize(frame.width, frame.height);
    strip.mark(frame);
  }

  /** Colours the object by how depth agrees with it, once the depth image of the frame is there. */
  function showAgreement(isWanted) {
    if (!isWanted) depth = null;
    else if (depth?.frame !== shown) {
      const wanted = { frame: shown };
      depth = wanted;
      depthOf(shown)
        .then((content) => {
          Object.assign(wanted, { content });
          drawSoon();
        })
        .catch(page.message.problem);
    }
  }

  function showView(newView) {
    view = newView;
    Object.assign(boxSize, { width: box.clientWidth, height: box.clientHeight });
    image.style.transform = `translate(${view.left}px, ${view.top}px) scale(${view.scale})`;
    image.classList.toggle("close", view.scale > CLOSE);
    setText(byId("zoom-fit-text"), zoom.isWhole() ? "Fit" : "Whole");
    if (!zoom.isWhole()) box.dispatchEvent(new Event("zoomed"));
    drawSoon();
  }

  /** Draws at the next picture of the screen, however much changes until then. */
  function drawSoon() {
    if (!isWaiting) requestAnimationFrame(drawOutline);
    isWaiting = true;
  }

  function drawOutline() {
    isWaiting = false;
    if (!drawMesh || !registration || canvas.hidden) return;
    const { T_camera_object: T } = registration;
    const unit = Math.min(devicePixelRatio, 2);
    resize(canvas, Math.round(boxSize.width * unit), Math.round(boxSize.height * unit));
    const { scale, left, top } = view;
    const camera = shownCamera(shown.intrinsics, { scale: scale * unit, left: left * unit, top: top * unit });
    const { width, height } = canvas;
    const look = { color: colorNow(), blend: blend.valueAsNumber, unit, depth: depth?.content };
    drawMesh({ width, height, camera, T, ...look });
  }

  /** Draws the object where it is now, here and in the thumbnails. */
  function drawPose() {
    drawSoon();
    if (drawMesh && registration) {
      const { T_world_object, dragging } = registration;
      strip.draw({ drawOn, T_world_object, color: colorNow(), dragging });
    }
  }

  /** Whose pose it is; asked of the style sheet once, since asking computes the styles of the page. */
  function colorNow() {
    const { source } = canvas.dataset;
    colors[source] ??= rgb(getComputedStyle(canvas).color);
    return colors[source];
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
  return { title: "Image and frames", bindings, open, draw };
}

/** The registration as if the object were where the operator looks before taking it. */
function asLookedAt(registration, { T_world_camera }) {
  const { preview } = registration;
  return { ...registration, T_world_object: preview, T_camera_object: relativeTo(T_world_camera, preview) };
}
