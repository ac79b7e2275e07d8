import assert from "node:assert/strict";
import { test } from "node:test";
import { axisText, groupText, isAlong, normalized, residualText } from "../../../static/objects/axes.js";

const about = (axis, fold = 2) => ({ axis, point: [0, 0, 0], fold });

test("an axis near one of the mesh is called by its name, others by numbers", () => {
  assert.equal(axisText(about([0, 0.02, -0.9998], 4)), "quarter turns about z");
  assert.equal(axisText(about([1, 0, 0], null)), "any angle about x");
  assert.equal(axisText(about([0, 0.6, 0.8], 5)), "1/5 turns about (0.00, 0.60, 0.80)");
});

test("an axis and its opposite read the same", () => {
  assert.equal(axisText(about([-0.6, 0, 0.8])), axisText(about([0.6, 0, -0.8])));
  assert.ok(isAlong(about([-0.6, 0, 0.8]), about([0.6, 0, -0.8])));
  assert.ok(!isAlong(about([1, 0, 0]), about([0.99, 0.14, 0])));
});

test("a direction of any length gets length 1, even where squares would overflow", () => {
  assert.deepEqual(normalized(about([0, 3, 4])).axis, [0, 0.6, 0.8]);
  assert.deepEqual(normalized(about([0, 3e200, 4e200])).axis, [0, 0.6, 0.8]);
  assert.deepEqual(normalized(about([1e-300, 0, 0])).axis, [1, 0, 0]);
  for (const none of [
    [0, 0, 0],
    [Number.NaN, 0, 1],
    [Number.POSITIVE_INFINITY, 0, 0],
  ]) {
    assert.equal(normalized(about(none)), null);
  }
});

test("a residual is told in millimetres and of the diameter", () => {
  assert.equal(residualText(0.00031, 0.155), "misses by 0.31 mm, 0.2 %");
});

test("symmetries are named by what they amount to", () => {
  const groups = [
    { discrete: [], continuous: [] },
    { discrete: [1, 2, 3], continuous: [] },
    { discrete: [], continuous: [1] },
    { discrete: [1], continuous: [1] },
    { discrete: [], continuous: [1, 2] },
  ];
  assert.deepEqual(groups.map(groupText), [
    "none",
    "4 rotations",
    "round",
    "round, and can be flipped",
    "a sphere's",
  ]);
});
