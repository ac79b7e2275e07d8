import assert from "node:assert/strict";
import { test } from "node:test";
import { noteOn } from "../../../static/study/amounts.js";

const preview = (rows, orders) => ({
  rows_of_balance: rows,
  orders: Array(orders),
  minutes_a_task: { quick: 1, accurate: 3 },
});

test("groups that a balanced order cannot be dealt to evenly are named", () => {
  const { order, time } = noteOn({ groups: { novice: 8, expert: 6 } }, preview(4, 8));
  assert.match(
    order,
    /^For an even balance groups need a multiple of 4 participants; that is not so for expert\./,
  );
  assert.match(time, /1 min for a task in “quick” and 3 min for a task in “accurate”/);
});

test("an even balance is said, and how many orders are shown where not all are", () => {
  assert.equal(
    noteOn({ groups: { novice: 8 } }, preview(4, 8)).order,
    "The order is balanced evenly. Operator 1 is the first one of each group, and so on.",
  );
  assert.match(noteOn({ groups: { novice: 8 } }, preview(4, 5)).order, /Shown are the first 5/);
});
