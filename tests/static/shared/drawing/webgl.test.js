import assert from "node:assert/strict";
import { test } from "node:test";
import { columns, NEAR, projection } from "../../../../static/shared/drawing/webgl.js";

const CAMERA = { fx: 500, fy: 400, cx: 319.5, cy: 239.5 };
const [WIDTH, HEIGHT] = [640, 480];

function clipped([x, y, z]) {
  const [u, v, depth, w] = projection(CAMERA, WIDTH, HEIGHT).map(([a, b, c, d]) => a * x + b * y + c * z + d);
  return [u / w, v / w, depth / w];
}

test("the principal point in the middle of the picture is the middle of clip space", () => {
  const [u, v] = clipped([0, 0, 2]);
  assert.ok(Math.abs(u) < 1e-12 && Math.abs(v) < 1e-12);
});

test("the corner of the first pixel is the upper left corner of clip space", () => {
  const z = 2;
  const [u, v] = clipped([((-0.5 - CAMERA.cx) / CAMERA.fx) * z, ((-0.5 - CAMERA.cy) / CAMERA.fy) * z, z]);
  assert.ok(Math.abs(u + 1) < 1e-12 && Math.abs(v - 1) < 1e-12);
});

test("depth grows from -1 at the near plane", () => {
  const depths = [NEAR, 1, 10, 100].map((z) => clipped([0, 0, z])[2]);
  assert.ok(Math.abs(depths[0] + 1) < 1e-9 && Math.abs(depths[3] - 1) < 1e-9);
  assert.deepEqual(
    depths,
    depths.toSorted((one, other) => one - other),
  );
});

test("WebGL gets a matrix column by column", () => {
  const rows = [0, 4, 8, 12].map((first) => [first, first + 1, first + 2, first + 3]);
  assert.deepEqual([...columns(rows)], [0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15]);
});
