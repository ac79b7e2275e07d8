import assert from "node:assert/strict";
import { test } from "node:test";
import { addressWith, filterIn, isNarrow } from "../../../static/shared/task-filter.js";

const OPEN = { dataset_id: null, scene_id: null, state: null, mode: null, condition: null };

test("an address gives back the filter that it was made with", () => {
  const filter = { ...OPEN, dataset_id: "3", condition: "three points" };
  const address = addressWith("/label/7", filter);
  assert.equal(address, "/label/7?dataset_id=3&condition=three+points");
  assert.deepEqual(filterIn(new URL(address, "http://localhost").search), filter);
});

test("a filter that leaves all open adds nothing", () => {
  assert.equal(addressWith("/", filterIn("?frame=2")), "/");
});

test("a dataset alone is not a part of it", () => {
  assert.equal(isNarrow({ ...OPEN, dataset_id: "3" }), false);
  assert.equal(isNarrow({ ...OPEN, state: "open" }), true);
});
