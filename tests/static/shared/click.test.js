import assert from "node:assert/strict";
import { test } from "node:test";
import { distance } from "../../../static/shared/click.js";

test("the distance of two events is that of their places", () => {
  assert.equal(distance({ clientX: 1, clientY: 2 }, { clientX: 4, clientY: 6 }), 5);
});
