import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { zoomable } from "../../../../static/shared/drawing/zoom.js";

const BOX = { clientWidth: 400, clientHeight: 300, addEventListener: () => {} };
let shown;
let zoom;

beforeEach(() => {
  globalThis.ResizeObserver = class {
    observe() {}
  };
  zoom = zoomable(BOX, (view) => {
    shown = view;
  });
  zoom.setSize(800, 400);
});

/** Where a point of the picture [its pixels] is in the box. */
const place = (x, y) => [shown.left + x * shown.scale, shown.top + y * shown.scale];

test("at first all of the picture is seen, in the middle of its box", () => {
  assert.deepEqual(shown, { scale: 0.5, left: 0, top: 50 });
  assert.ok(zoom.isWhole());
});

test("zooming in and out again is as before", () => {
  zoom.zoomIn();
  assert.equal(shown.scale, 0.75);
  assert.ok(!zoom.isWhole());
  zoom.zoomOut();
  assert.deepEqual(shown, { scale: 0.5, left: 0, top: 50 });
});

test("what is fitted lies in the middle and fills most of the box", () => {
  zoom.fit({ left: 300, top: 150, right: 340, bottom: 180 });
  assert.deepEqual(place(320, 165).map(Math.round), [200, 150]);
  assert.ok(Math.abs(40 * shown.scale - 0.62 * 400) < 1e-9);
});

test("no edge of the picture comes into the box while it is larger", () => {
  zoom.fit({ left: 0, top: 0, right: 40, bottom: 30 });
  assert.deepEqual(place(0, 0).map(Math.round), [0, 0]);
  zoom.fit({ left: 760, top: 370, right: 800, bottom: 400 });
  assert.deepEqual(place(800, 400).map(Math.round), [400, 300]);
});

test("there is an end to zooming", () => {
  for (let i = 0; i < 30; i++) zoom.zoomIn();
  assert.equal(shown.scale, 0.5 * 40);
  for (let i = 0; i < 30; i++) zoom.zoomOut();
  assert.ok(zoom.isWhole());
});
