/** Axes of symmetry {axis, point, fold} [metres, the mesh's frame] as words and numbers for people. */

const NAMES = ["x", "y", "z"];
const ALONG = Math.cos(Math.PI / 60); // so near to an axis of the mesh it is called by that one's name
const SAME = Math.cos(Math.PI / 30); // registration_core's SAME_AXIS

export const HIGHEST_FOLD = 24; // registration_core's
const TURNS = { 2: "half turns", 3: "thirds of a turn", 4: "quarter turns" };

/**
 * "any angle", "half turns", "1/5 turns".
 *
 * @param {number | null} fold
 */
export function foldText(fold) {
  return fold === null ? "any angle" : (TURNS[fold] ?? `1/${fold} turns`);
}

/**
 * "about z", or "about (0.58, 0.58, 0.58)": what tells axes of one object apart.
 *
 * @param {Pick<Rest["AxisOut"], "axis">} axis
 */
export function directionText({ axis }) {
  const near = axis.findIndex((value) => Math.abs(value) > ALONG);
  if (near >= 0) return `about ${NAMES[near]}`;
  const sign = (axis.find((value) => Math.abs(value) > 0.005) ?? 0) < 0 ? -1 : 1;
  return `about (${axis.map((value) => (sign * value + 0).toFixed(2).replace("-0.00", "0.00")).join(", ")})`;
}

/**
 * "quarter turns about z".
 *
 * @param {Rest["AxisOut"]} axis
 */
export const axisText = (axis) => `${foldText(axis.fold)} ${directionText(axis)}`;

/**
 * "misses by 0.31 mm, 0.2 %"; of the diameter, as the page says once.
 *
 * @param {number} residual
 * @param {number} diameter
 */
export function residualText(residual, diameter) {
  return `misses by ${(1000 * residual).toFixed(2)} mm, ${((100 * residual) / diameter).toFixed(1)} %`;
}

/**
 * Whether two axes have one direction.
 *
 * @param {{ axis: Vector }} one
 * @param {{ axis: Vector }} other
 */
export function isAlong(one, other) {
  return Math.abs(one.axis.reduce((sum, value, k) => sum + value * other.axis[k], 0)) > SAME;
}

/** A copy whose direction has length 1; null where it has none. */
export function normalized(axis) {
  const largest = Math.max(...axis.axis.map(Math.abs));
  if (!(largest > 0 && Number.isFinite(largest))) return null;
  const scaled = axis.axis.map((value) => value / largest);
  const length = Math.hypot(...scaled);
  return { ...axis, axis: scaled.map((value) => value / length) };
}

/**
 * "no symmetries", "any angle, 1 flip", "8 rotations": what symmetries amount to.
 *
 * @param {{ discrete: unknown[], continuous: unknown[] }} symmetries
 */
export function groupText({ discrete, continuous }) {
  if (continuous.length > 1) return "a sphere's";
  if (continuous.length === 1) return discrete.length ? "round, and can be flipped" : "round";
  return discrete.length ? `${discrete.length + 1} rotations` : "none";
}
