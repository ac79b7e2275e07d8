import assert from "node:assert/strict";
import { test } from "node:test";
import { presenter } from "../../../static/replay/presenter.js";

test("of what is asked for meanwhile only the newest is asked of the server", async () => {
  const asked = [];
  await new Promise((done) => {
    const present = presenter(
      async (wanted) => {
        asked.push(wanted);
        return wanted;
      },
      (drawn) => drawn === 4 && done(),
      assert.ifError,
    );
    for (const wanted of [1, 2, 3, 4]) present(wanted);
  });
  assert.deepEqual(asked, [1, 4]);
});

test("an error is told, and the next is shown all the same", async () => {
  const problems = [];
  await new Promise((done) => {
    const present = presenter(
      async (wanted) => {
        if (wanted === 1) throw new Error("Not there.");
        return wanted;
      },
      done,
      (error) => {
        problems.push(error.message);
        present(2);
      },
    );
    present(1);
  });
  assert.deepEqual(problems, ["Not there."]);
});
