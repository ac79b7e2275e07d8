import assert from "node:assert/strict";
import { test } from "node:test";
import { groupsOf, questionsOf } from "../../../static/study/plan-text.js";

test("groups are names with numbers", () => {
  assert.deepEqual(groupsOf("novice 8, expert 12"), [
    ["novice", 8],
    ["expert", 12],
  ]);
  assert.deepEqual(groupsOf(" group 2 8 ,, x"), [
    ["group 2", 8],
    ["x", 0],
  ]);
  assert.deepEqual(groupsOf(" "), []);
});

test("questions stand in a line each, with choices after a colon", () => {
  assert.deepEqual(questionsOf("Age\n\nHandedness (optional): left, right,\nTime: 10:30, later"), [
    { text: "Age", choices: [], optional: false },
    { text: "Handedness", choices: ["left", "right"], optional: true },
    { text: "Time", choices: ["10:30", "later"], optional: false },
  ]);
});

test("a question is optional by a word at its end, wherever its choices are", () => {
  assert.deepEqual(questionsOf("Hand: left, right (Optional)"), [
    { text: "Hand", choices: ["left", "right"], optional: true },
  ]);
  assert.equal(questionsOf("Is it (optional) for you?")[0].optional, false);
});
