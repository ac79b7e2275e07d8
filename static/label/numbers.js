/** The pose of the object in the camera as numbers, which can be typed over. */

import { poseNumbers, product, withNumber } from "../shared/drawing/pose.js";

/**
 * A part of the labelling page.
 *
 * @param {LabelPage} page
 * @returns {Part}
 */
export function numbersPart(page) {
  const fields = /** @type {HTMLInputElement[]} */ ([...document.querySelectorAll("[data-pose]")]);
  let frames = [];
  let shown = {};
  for (const field of fields) {
    field.addEventListener("focus", () => field.select());
    field.addEventListener("blur", () => restore(field));
    field.addEventListener("keydown", (event) => {
      if (event.key === "Enter") commit(field);
      else if (event.key === "Escape") field.blur();
    });
  }

  const restore = (field) => (field.value = shown[field.dataset.pose]);

  function draw({ T_camera_object: T }) {
    shown = poseNumbers(T);
    for (const field of fields) {
      field.readOnly = !page.canMove() || !page.has("precision");
      if (field !== document.activeElement) restore(field);
    }
  }

  async function commit(field) {
    const text = field.value.trim().replace(",", ".").replace("−", "-");
    const value = Number(text);
    if (text === "" || !Number.isFinite(value)) {
      page.message.show(`“${field.value}” is no number; Escape brings the old one back.`, "problem");
      return;
    }
    const name = field.dataset.pose;
    const isNew = text !== shown[name];
    field.blur();
    if (!isNew || !page.canMove()) return;
    const { frame_id: frameId, T_camera_object: T } = page.registration();
    const { T_world_camera } = frames.find((frame) => frame.id === frameId);
    const T_world_object = product(T_world_camera, withNumber(T, name, value));
    page.message.clear();
    await page.put("pose", { T_world_object, technique: "numbers" }).catch(page.message.problem);
  }

  return { open: (_task, scene) => (frames = scene.frames), draw };
}
