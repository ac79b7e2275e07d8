import assert from "node:assert/strict";
import { test } from "node:test";
import { digits, errorText, intervalText, secondsText, shareText } from "../../../static/report/numbers.js";

test("errors are millimetres or degrees, with three digits", () => {
  assert.equal(errorText(0.0042, "translation"), "4.2\u00a0mm");
  assert.equal(errorText(Math.PI / 15, "rotation"), "12°");
  assert.equal(digits(1234.5), "1230");
});

test("what is unknown is a dash", () => {
  assert.deepEqual(
    [errorText(null, "rotation"), secondsText(null), shareText(null), digits(null)],
    ["–", "–", "–", "–"],
  );
});

test("an interval is there where it is known", () => {
  assert.equal(
    intervalText({ mean: 2, low: 1.5, high: 2.5 }, secondsText),
    "2\u00a0s (1.5\u00a0s to 2.5\u00a0s)",
  );
  assert.equal(intervalText({ mean: 2, low: null, high: null }, secondsText), "2\u00a0s");
});
