import assert from "node:assert/strict";
import { afterEach, test } from "node:test";
import {
  ApiError,
  get,
  getAll,
  onSignedOut,
  problemSentence,
  UNREACHABLE,
} from "../../../static/shared/api.js";

const { fetch } = globalThis;
afterEach(() => {
  globalThis.fetch = fetch;
});

/** Lets a server answer with these, one after the other; returns what it was asked for. */
function serve(...answers) {
  const asked = [];
  globalThis.fetch = async (path) => {
    asked.push(path);
    const { status = 200, json } = answers.shift();
    return new Response(JSON.stringify(json), { status });
  };
  return asked;
}

test("a problem is its detail, its title, or else its number", () => {
  assert.equal(
    problemSentence(409, '{"detail": "It is submitted.", "title": "Conflict"}'),
    "It is submitted.",
  );
  assert.equal(problemSentence(409, '{"detail": [], "title": "Conflict"}'), "Conflict");
  for (const text of ["<html>", "", "{}"]) {
    assert.equal(problemSentence(502, text), "The server answered with error 502. Nothing was changed.");
  }
});

test("what a query leaves open is not in the address", async () => {
  const asked = serve({ json: {} }, { json: {} });
  await get("/api/tasks/next", { dataset_id: 3, state: "", mode: null, condition: "paper snap" });
  await get("/api/tasks/next", {});
  assert.deepEqual(asked, ["/api/tasks/next?dataset_id=3&condition=paper+snap", "/api/tasks/next"]);
});

test("all pages of a list are one list", async () => {
  const asked = serve({ json: { items: [1, 2], next: 2 } }, { json: { items: [3], next: null } });
  assert.deepEqual(await getAll("/api/datasets"), [1, 2, 3]);
  assert.deepEqual(asked, ["/api/datasets?limit=200", "/api/datasets?limit=200&after=2"]);
});

test("what was asked while signed out is asked again after signing in", async () => {
  const asked = serve({ status: 401, json: {} }, { json: { name: "Ada" } });
  let signedIn = 0;
  onSignedOut(async () => {
    signedIn += 1;
  });
  assert.deepEqual(await get("/api/me"), { name: "Ada" });
  assert.deepEqual([signedIn, asked.length], [1, 2]);
});

test("a server that is not there is said in a sentence", async () => {
  globalThis.fetch = () => Promise.reject(new TypeError("Failed to fetch"));
  await assert.rejects(
    get("/api/me"),
    (error) => error instanceof ApiError && error.status === 0 && error.message === UNREACHABLE,
  );
});
