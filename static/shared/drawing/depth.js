/** Depth images as WebGL takes them, and the colours in which they judge an object. */

import { rgb } from "../dom.js";

const VERDICTS = ["no-data", "match", "in-front", "behind"];
const loaded = new Map();

/**
 * The depth image of a frame, loaded once: what `meshDrawing` takes as `depth`.
 *
 * @param {Rest["FrameOut"]} frame
 */
export function depthOf(frame) {
  if (!loaded.has(frame)) {
    const loading = load(frame);
    loading.catch(() => loaded.delete(frame));
    loaded.set(frame, loading);
  }
  return loaded.get(frame);
}

async function load({
  raw_depth_url: url,
  width,
  height,
  depth_scale: scale,
  depth_tolerance: tolerance,
  intrinsics,
}) {
  const answer = await fetch(url);
  if (!answer.ok)
    throw new Error("The depth image could not be loaded; switch the agreement off and on to try again.");
  const { fx, fy, cx, cy } = intrinsics;
  return {
    raw: new Uint16Array(await answer.arrayBuffer()),
    width,
    height,
    metres: scale / 1000,
    tolerance,
    sensor: [fx, fy, cx, cy],
    verdicts: VERDICTS.map((name) => colorOf(`--${name}`)),
  };
}

/** A colour that the style sheet gives as a variable. */
function colorOf(variable) {
  const probe = document.createElement("span");
  probe.style.color = `var(${variable})`;
  document.body.append(probe);
  const color = rgb(getComputedStyle(probe).color);
  probe.remove();
  return color;
}
