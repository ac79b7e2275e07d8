import assert from "node:assert/strict";
import { test } from "node:test";
import {
  poseNumbers,
  product,
  relativeTo,
  rotationMatrix,
  rotationVector,
  withNumber,
} from "../../../../static/shared/drawing/pose.js";

const IDENTITY = [0, 1, 2, 3].map((row) => [0, 1, 2, 3].map((column) => Number(row === column)));
const VECTORS = [
  [0, 0, 0],
  [0.3, -0.2, 0.9],
  [0, 0, Math.PI / 2],
  [-2, 1, 1.5],
  [3.1, 0, 0],
];

function assertNear(actual, wanted, within = 1e-9) {
  const numbers = actual.flat();
  assert.equal(numbers.length, wanted.flat().length);
  wanted.flat().forEach((value, index) => {
    assert.ok(Math.abs(numbers[index] - value) < within, `${actual} is not ${wanted}`);
  });
}

const poseOf = (vector, position) => [
  ...rotationMatrix(vector).map((row, i) => [...row, position[i]]),
  [0, 0, 0, 1],
];
const transposed = (matrix) => matrix[0].map((_, column) => matrix.map((row) => row[column]));

test("a rotation matrix gives back its rotation vector", () => {
  for (const vector of VECTORS) assertNear(rotationVector(rotationMatrix(vector)), vector);
});

test("a rotation matrix is orthonormal", () => {
  for (const vector of VECTORS) {
    const R = rotationMatrix(vector);
    assertNear(product(transposed(R), R), rotationMatrix([0, 0, 0]));
  }
});

test("half a turn has a vector of length pi along its axis, either way", () => {
  const [x, y, z] = rotationVector(rotationMatrix([0, Math.PI, 0]));
  assertNear([Math.abs(y), x, z], [Math.PI, 0, 0]);
});

test("a quarter turn about z takes x to y", () => {
  assertNear(product(rotationMatrix([0, 0, Math.PI / 2]), [[1], [0], [0]]), [[0], [1], [0]]);
});

test("what is relative to a frame comes back by it", () => {
  const [A, B] = [poseOf([0.3, -0.2, 0.9], [0.1, -0.4, 0.8]), poseOf([-2, 1, 1.5], [0, 0.2, -0.3])];
  assertNear(product(A, relativeTo(A, B)), B);
  assertNear(relativeTo(A, A), IDENTITY);
});

test("people read millimetres and degrees, without a minus before nothing", () => {
  const T = poseOf([0, 0, Math.PI / 2], [0.1234, -0.00001, 0]);
  assert.deepEqual(poseNumbers(T), { x: "123.4", y: "0.0", z: "0.0", rx: "0.0", ry: "0.0", rz: "90.0" });
});

test("one number is changed, and the others stay exactly as they were", () => {
  const T = poseOf([0.3, -0.2, 0.9], [0.1, -0.4, 0.8]);
  const shifted = withNumber(T, "y", 25);
  assert.deepEqual(
    shifted.map((row) => row.slice(0, 3)),
    T.map((row) => row.slice(0, 3)),
  );
  assertNear(
    shifted.slice(0, 3).map((row) => row[3]),
    [0.1, 0.025, 0.8],
  );
  const turned = withNumber(T, "rz", 30);
  assert.deepEqual(
    turned.map((row) => row[3]),
    T.map((row) => row[3]),
  );
  assertNear(rotationVector(turned), [0.3, -0.2, Math.PI / 6]);
});
