/** Clicks and drags told apart. */

/** Pixels; a pointer that moved farther has dragged. */
export const LARGEST_CLICK = 4;

/**
 * How far a pointer has moved between two events [pixels].
 *
 * @param {Pick<MouseEvent, "clientX" | "clientY">} one
 * @param {Pick<MouseEvent, "clientX" | "clientY">} other
 */
export function distance(one, other) {
  return Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
}
