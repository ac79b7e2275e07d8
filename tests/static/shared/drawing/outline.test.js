import assert from "node:assert/strict";
import { test } from "node:test";
import { extentInPicture, shownCamera } from "../../../../static/shared/drawing/outline.js";

const CAMERA = { fx: 100, fy: 100, cx: 49.5, cy: 39.5 };
const ahead = (z) => [
  [1, 0, 0, 0],
  [0, 1, 0, 0],
  [0, 0, 1, z],
  [0, 0, 0, 1],
];
const MESH = { vertices: Float32Array.from([-0.5, -0.25, 0, 0.5, -0.25, 0, 0, 0.25, 0]) };

test("a picture shown as it is has the camera that took it", () => {
  assert.deepEqual(shownCamera(CAMERA, { scale: 1, left: 0, top: 0 }), CAMERA);
});

test("a point of a picture that is zoomed and shifted goes with it", () => {
  const { fx, cx, cy } = shownCamera(CAMERA, { scale: 3, left: 10, top: -20 });
  const across = 0.2; // x / z of a point
  const inPicture = CAMERA.fx * across + CAMERA.cx + 0.5; // from the corner
  assert.ok(Math.abs(fx * across + cx + 0.5 - (3 * inPicture + 10)) < 1e-9);
  assert.equal(cy + 0.5, 3 * (CAMERA.cy + 0.5) - 20);
});

test("the box of a mesh holds it in pixels from the picture's corner", () => {
  assert.deepEqual(extentInPicture(MESH, ahead(1), CAMERA), { left: 0, top: 15, right: 100, bottom: 65 });
  assert.deepEqual(extentInPicture(MESH, ahead(2), CAMERA), { left: 25, top: 27.5, right: 75, bottom: 52.5 });
});

test("a mesh behind the camera has none", () => {
  assert.equal(extentInPicture(MESH, ahead(-1), CAMERA), null);
});
