/** How far the object was from its last pose, in millimetres and degrees on one logarithmic scale. */

const LEAST = 0.3; // mm or degrees: nothing below it matters to the eye
const MARGIN = 9; // pixels above and below
const DEGREES = 180 / Math.PI;

/**
 * Path data of the two curves [mm, degrees]; `at(seconds)` is a place across.
 *
 * @param {Rest["Curve"]} curve
 * @param {(seconds: number) => number} at
 * @param {number} height
 */
export function curvePaths(curve, at, height) {
  const y = scale(curve, height);
  return bothInPeople(curve).map((values) =>
    values.map((value, i) => `${i ? "L" : "M"}${at(curve.seconds[i])} ${y(value)}`).join(""),
  );
}

/**
 * [{value: "10", y}, ...]: the powers of ten within the scale.
 *
 * @param {Rest["Curve"]} curve
 * @param {number} height
 */
export function curveTicks(curve, height) {
  const y = scale(curve, height);
  return [1, 10, 100, 1000]
    .filter((value) => value < most(curve))
    .map((value) => ({ value: String(value), y: y(value) }));
}

const bothInPeople = ({ translation, rotation }) => [
  translation.map((metres) => metres * 1000),
  rotation.map((radians) => radians * DEGREES),
];

const most = (curve) =>
  bothInPeople(curve)
    .flat()
    .reduce((one, other) => Math.max(one, other), 2 * LEAST);

function scale(curve, height) {
  const decades = Math.log(most(curve) / LEAST);
  return (value) => {
    const share = Math.log(Math.max(value, LEAST) / LEAST) / decades;
    return Number((height - MARGIN - share * (height - 2 * MARGIN)).toFixed(1));
  };
}
