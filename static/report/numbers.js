/** Numbers of reports as people read them; no line is broken between a number and its unit. */

const DEGREES = 180 / Math.PI;
const NONE = "–";

/** Millimetres of metres, degrees of radians. */
export const inPeopleUnits = (value, error) => (error === "translation" ? value * 1000 : value * DEGREES);

export const unitOf = (error) => (error === "translation" ? "mm" : "°");

/**
 * "4.2 mm", "12°"; a dash for what is unknown.
 *
 * @param {number | null} value
 * @param {"translation" | "rotation"} error
 */
export function errorText(value, error) {
  if (value === null) return NONE;
  const number = digits(inPeopleUnits(value, error));
  return error === "translation" ? `${number}\u00a0mm` : `${number}°`;
}

/** "12.3 s". */
export const secondsText = (value) => (value === null ? NONE : `${digits(value)}\u00a0s`);

/** "94 %". */
export const shareText = (value) => (value === null ? NONE : `${Math.round(value * 100)}\u00a0%`);

/**
 * "4.2 mm (3.9 mm to 4.6 mm)" of {mean, low, high}; `text` writes one number.
 *
 * @param {Pick<Rest["IntervalOut"], "mean" | "low" | "high">} interval
 * @param {(value: number | null) => string} text
 */
export function intervalText({ mean, low, high }, text) {
  return low === null ? text(mean) : `${text(mean)} (${text(low)} to ${text(high)})`;
}

/**
 * Three significant digits.
 *
 * @param {number | null} value
 */
export function digits(value) {
  return value === null ? NONE : String(Number(value.toPrecision(3)));
}
