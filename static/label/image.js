/** The colour image of the frame, with a circle where the object is, and the choice of the frame. */

import { put } from "../api.js";
import { byId, setText } from "../dom.js";

/** A part of the labelling page. */
export function imagePart(page) {
  const image = byId("color");
  let frames = [];
  let radius = 0;
  let shownId = null;
  image.addEventListener("load", () => (image.hidden = false));
  image.addEventListener("error", () => (image.hidden = true));
  byId("frame-previous").addEventListener("click", () => step(-1));
  byId("frame-next").addEventListener("click", () => step(+1));

  const indexOf = (frameId) => frames.findIndex((frame) => frame.id === frameId);
  const beside = (by) => frames[indexOf(shownId) + by] ?? null;

  function open(_task, scene, object) {
    frames = scene.frames;
    radius = object.diameter / 2;
    byId("frames").hidden = frames.length < 2;
  }

  async function step(by) {
    const frame = beside(by);
    if (!frame || !page.isConnected()) return;
    await put(page.path("frame"), { frame_id: frame.id }).catch(page.message.problem);
  }

  function draw({ frame_id: frameId, T_camera_object: T, confidence }) {
    const index = indexOf(frameId);
    const frame = frames[index];
    if (!frame) return;
    if (shownId !== frameId) showFrame(frame, index);
    drawMarker(frame, T, radius, confidence === null ? "human" : "machine");
  }

  function showFrame(frame, index) {
    shownId = frame.id;
    if (frame.color_url) image.src = frame.color_url;
    else image.hidden = true;
    byId("overlay").setAttribute("viewBox", `0 0 ${frame.width} ${frame.height}`);
    const place = frames.length > 1 ? ` (${index + 1} of ${frames.length})` : "";
    setText(byId("frame-name"), `Frame ${frame.image_id}${place}`);
    byId("frame-previous").disabled = beside(-1) === null;
    byId("frame-next").disabled = beside(+1) === null;
  }

  const bindings = [
    { keys: [","], does: "Previous frame", run: () => step(-1) },
    { keys: ["."], does: "Next frame", run: () => step(+1) },
  ];
  return { bindings, open, draw };
}

/** Draws the sphere of `radius` [m] around the object's origin as a circle in the image. */
function drawMarker({ intrinsics: { fx, fy, cx, cy } }, T, radius, source) {
  const marker = byId("marker");
  const [x, y, z] = [T[0][3], T[1][3], T[2][3]];
  const inFront = z > radius;
  marker.setAttribute("r", inFront ? (fx * radius) / z : 0);
  if (!inFront) return;
  marker.setAttribute("cx", (fx * x) / z + cx);
  marker.setAttribute("cy", (fy * y) / z + cy);
  marker.dataset.source = source;
}
