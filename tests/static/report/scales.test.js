import assert from "node:assert/strict";
import { test } from "node:test";
import { BOX, scalesOf } from "../../../static/report/scales.js";

const point = (margin, seconds, high = null) => ({ margin, seconds, high });
const SERIES = [{ points: [point(100, 2), point(10, 20, 45)] }, { points: [point(1, null)] }];

test("margins go from large to small across the box, in powers", () => {
  const { x } = scalesOf(SERIES, "translation");
  assert.deepEqual([100, 10, 1].map(x), [BOX.left, (BOX.left + BOX.right) / 2, BOX.right]);
});

test("seconds go from nothing at the bottom to a round number above all", () => {
  const { y, seconds } = scalesOf(SERIES, "translation");
  assert.deepEqual(seconds, [0, 10, 20, 30, 40, 50]);
  assert.deepEqual([y(0), y(50)], [BOX.bottom, BOX.top]);
});

test("there are few ticks, however long it took", () => {
  for (const most of [0.2, 3, 59, 700, 5000, 99_999]) {
    const { seconds } = scalesOf([{ points: [point(10, most), point(1, most)] }], "rotation");
    assert.ok(seconds.length <= 7 && seconds.at(-1) >= most, `${most}: ${seconds}`);
  }
});

test("only ticks of margins that there are", () => {
  const between = [{ points: [point(60, 1), point(2, 1)] }];
  assert.deepEqual(scalesOf(between, "translation").margins, [50, 20, 10, 5, 2]);
  assert.deepEqual(scalesOf(between, "rotation").margins, [45, 20, 10, 5, 2]);
});
