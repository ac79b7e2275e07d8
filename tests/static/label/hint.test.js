import assert from "node:assert/strict";
import { test } from "node:test";
import { hintFor } from "../../../static/label/hint.js";

const OPEN = { state: "open", tools: ["snap"], can_undo: false, confidence: null, snap: null, offer: null };

test("from the start pose to the submission there is one next step", () => {
  const steps = [
    OPEN,
    { ...OPEN, can_undo: true },
    { ...OPEN, confidence: 0.3 },
    { ...OPEN, confidence: 0.9 },
  ];
  assert.deepEqual(steps.map(hintFor), [
    "Drag the object near its points, then snap.",
    "Roughly in place? Then snap.",
    "Not sure: drag it closer, and snap again.",
    "Right from every side? Then submit.",
  ]);
});

test("without the machine nobody is sent to it", () => {
  const alone = { ...OPEN, tools: [] };
  for (const moved of [alone, { ...alone, can_undo: true }]) assert.doesNotMatch(hintFor(moved), /[Ss]nap/);
});

test("while the machine works or asks, and after the end, nothing is hinted at", () => {
  const busy = [
    { snap: { state: "queued" } },
    { snap: { state: "running" } },
    { offer: {} },
    { state: "submitted" },
  ];
  assert.deepEqual(
    busy.map((more) => hintFor({ ...OPEN, ...more })),
    ["", "", "", ""],
  );
});
