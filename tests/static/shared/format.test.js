import assert from "node:assert/strict";
import { test } from "node:test";
import { count, fileSize, framesText, percent } from "../../../static/shared/format.js";

test("one is singular, all else plural", () => {
  assert.deepEqual(
    [0, 1, 2, 1200].map((number) => count(number, "scene")),
    ["0 scenes", "1 scene", "2 scenes", "1,200 scenes"],
  );
});

test("a share is said in percent, with three digits at most", () => {
  assert.deepEqual([0.05, 0.005, 1, 0.12345].map(percent), ["5 %", "0.5 %", "100 %", "12.3 %"]);
});

test("sizes of files are never said to be nothing", () => {
  assert.deepEqual([1, 12_000, 8_400_000, 312_000_000].map(fileSize), ["1 kB", "12 kB", "8.4 MB", "312 MB"]);
});

test("frames are named where there are several, or where others were asked", () => {
  assert.equal(framesText(null), "");
  assert.equal(framesText({ used: 1, agreeing: 0, asked: 0 }), "");
  assert.equal(framesText({ used: 3, agreeing: 0, asked: 0 }), "3 frames");
  assert.equal(framesText({ used: 1, agreeing: 0, asked: 1 }), "1 frame, 0 of 1 other agrees");
  assert.equal(framesText({ used: 3, agreeing: 2, asked: 2 }), "3 frames, 2 of 2 others agree");
});
