import assert from "node:assert/strict";
import { test } from "node:test";
import { placedProblem } from "../../../static/study/field-problems.js";

test("a problem is placed at the field that it is about", () => {
  assert.deepEqual(placedProblem("body.plan.questions.1.choices: left is the only choice."), [
    "questions",
    "Question 2: left is the only choice.",
  ]);
  assert.deepEqual(placedProblem("body.plan.break_after: too large."), ["break-after", "Too large."]);
  assert.deepEqual(placedProblem("body.plan.practice.0: is not there."), ["things", "Is not there."]);
  assert.deepEqual(placedProblem("body.name: is taken."), ["name", "Is taken."]);
});

test("one about the plan as a whole, or about nothing in it, is at no field", () => {
  assert.deepEqual(placedProblem("body.plan: it is empty."), ["", "It is empty."]);
  assert.deepEqual(placedProblem("There already is a study “x”."), ["", "There already is a study “x”."]);
});
