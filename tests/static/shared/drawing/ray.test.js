import assert from "node:assert/strict";
import { test } from "node:test";
import { firstHit } from "../../../../static/shared/drawing/ray.js";

/** Two triangles across the z axis, at 1 and at 3. */
const MESH = {
  vertices: Float32Array.from([-1, -1, 1, 1, -1, 1, 0, 1, 1, -1, -1, 3, 1, -1, 3, 0, 1, 3]),
  faces: Uint32Array.from([3, 4, 5, 0, 1, 2]),
};

test("the nearest face is hit, in lengths of the direction", () => {
  assert.equal(firstHit(MESH, [0, 0, 0], [0, 0, 1]), 1);
  assert.equal(firstHit(MESH, [0, 0, 0], [0, 0, 0.5]), 2);
  assert.equal(firstHit(MESH, [0, 0, 2], [0, 0, 1]), 1);
});

test("faces are hit from both sides", () => {
  assert.equal(firstHit(MESH, [0, 0, 5], [0, 0, -1]), 2);
});

test("what lies beside, behind or along a face is missed", () => {
  assert.equal(firstHit(MESH, [2, 0, 0], [0, 0, 1]), null);
  assert.equal(firstHit(MESH, [0.9, 0.5, 0], [0, 0, 1]), null); // beyond the longest edge
  assert.equal(firstHit(MESH, [0, 0, 5], [0, 0, 1]), null);
  assert.equal(firstHit(MESH, [-5, 0, 1], [1, 0, 0]), null);
});
