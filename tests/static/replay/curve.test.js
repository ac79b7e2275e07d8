import assert from "node:assert/strict";
import { test } from "node:test";
import { curvePaths, curveTicks } from "../../../static/replay/curve.js";

const CURVE = { seconds: [0, 1, 2], translation: [0.5, 0.05, 0], rotation: [1, 0.1, 0] };
const HEIGHT = 64;

const heights = (path) => path.match(/ [\d.]+/g).map(Number);

test("both curves fall as the object comes near, and stay within the height", () => {
  for (const path of curvePaths(CURVE, (seconds) => 10 * seconds, HEIGHT)) {
    assert.match(path, /^M0 [\d.]+L10 [\d.]+L20 [\d.]+$/);
    const [first, second, last] = heights(path);
    assert.ok(first >= 9 && first < second && second < last && last === HEIGHT - 9, path);
  }
});

test("ticks are the powers of ten below the largest distance, where the curve has them", () => {
  const ticks = curveTicks(CURVE, HEIGHT);
  assert.deepEqual(
    ticks.map(({ value }) => value),
    ["1", "10", "100"],
  );
  const [path] = curvePaths({ ...CURVE, translation: [0.5, 0.1, 0.001] }, (seconds) => seconds, HEIGHT);
  assert.deepEqual(heights(path).slice(1), [ticks[2].y, ticks[0].y]);
});

test("an object that never moved has flat curves at the bottom", () => {
  const still = { seconds: [0], translation: [0], rotation: [0] };
  assert.deepEqual(curvePaths(still, () => 0, HEIGHT).flatMap(heights), [55, 55]);
});
