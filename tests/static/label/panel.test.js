import assert from "node:assert/strict";
import { test } from "node:test";
import { possible } from "../../../static/label/panel.js";

const OPEN = {
  state: "open",
  tools: ["snap", "ending"],
  can_undo: true,
  can_redo: false,
  dragging: false,
  snap: null,
  offer: null,
  live: null,
};

const can = (more, connected = true) => {
  const all = possible({ ...OPEN, ...more }, connected);
  return Object.keys(all).filter((action) => all[action]);
};

test("an open registration can be worked on with the tools of its condition", () => {
  assert.deepEqual(can({}), ["snap", "undo", "reset", "submit", "skip"]);
  assert.deepEqual(can({ tools: ["live snap"] }), ["live", "undo", "reset", "submit"]);
});

test("nothing is submitted while a snap runs, which can be cancelled, or while the object is dragged", () => {
  assert.deepEqual(can({ snap: { state: "running" } }), ["snap", "cancel", "undo", "reset", "skip"]);
  assert.ok(!can({ dragging: true }).includes("submit"));
});

test("an offer can be taken or dismissed, a live ghost only taken", () => {
  const offered = can({ offer: {} }).filter((action) => action.startsWith("offer"));
  assert.deepEqual(offered, ["offer-accept", "offer-dismiss"]);
  assert.deepEqual(
    can({ live: {} }).filter((action) => action.startsWith("offer")),
    ["offer-accept"],
  );
});

test("what is done can only be opened again, and nothing at all without a connection", () => {
  assert.deepEqual(can({ state: "submitted" }), ["reopen"]);
  assert.deepEqual(can({}, false), []);
  assert.deepEqual(Object.values(possible(null, true)).filter(Boolean), []);
});
