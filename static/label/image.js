/** The colour image of the frame, with a circle where the object is, and the choice of the frame. */

import { byId, setText } from "../dom.js";

/** `diameter` of the object in metres. Returns draw(registration), and step(+1 or -1): a frame's id or null. */
export function setUpImage(scene, diameter) {
  const image = byId("color");
  let shownId = null;
  image.addEventListener("load", () => (image.hidden = false));
  image.addEventListener("error", () => (image.hidden = true));
  byId("frames").hidden = scene.frames.length < 2;

  const indexOf = (frameId) => scene.frames.findIndex((frame) => frame.id === frameId);

  function step(by) {
    return scene.frames[indexOf(shownId) + by]?.id ?? null;
  }

  function draw({ frame_id: frameId, T_camera_object: T, confidence }) {
    const index = indexOf(frameId);
    const frame = scene.frames[index];
    if (!frame) return;
    if (shownId !== frameId) showFrame(frame, index);
    drawMarker(frame, T, diameter / 2, confidence === null ? "human" : "machine");
  }

  function showFrame(frame, index) {
    shownId = frame.id;
    if (frame.color_url) image.src = frame.color_url;
    else image.hidden = true;
    byId("overlay").setAttribute("viewBox", `0 0 ${frame.width} ${frame.height}`);
    const place = scene.frames.length > 1 ? ` (${index + 1} of ${scene.frames.length})` : "";
    setText(byId("frame-name"), `Frame ${frame.image_id}${place}`);
    byId("frame-previous").disabled = step(-1) === null;
    byId("frame-next").disabled = step(+1) === null;
  }

  return { draw, step };
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
