/** Poses (4x4 nested lists, row-major, metres) as numbers for people: millimetres and degrees. */

const DEGREES = 180 / Math.PI;

/**
 * {x, y, z} in mm and the rotation vector {rx, ry, rz} in degrees, as texts with one decimal.
 *
 * @param {Matrix} T
 */
export function poseNumbers(T) {
  const [x, y, z] = [T[0][3], T[1][3], T[2][3]].map((metres) => oneDecimal(metres * 1000));
  const [rx, ry, rz] = rotationVector(T).map((radians) => oneDecimal(radians * DEGREES));
  return { x, y, z, rx, ry, rz };
}

/**
 * Axis times angle [rad] of the rotation of a pose, by way of its quaternion (sound up to half a turn).
 *
 * @param {Matrix} T
 */
export function rotationVector(T) {
  const [w, ...axis] = quaternion(T);
  const sine = Math.hypot(...axis);
  if (sine < 1e-12) return [0, 0, 0];
  const angle = 2 * Math.atan2(sine, w);
  return axis.map((component) => (component / sine) * angle);
}

/**
 * The pose in a frame of axes, from both in the world: inverse(T_world_frame) @ T_world_object.
 *
 * @param {Matrix} T_world_frame
 * @param {Matrix} T_world_object
 */
export function relativeTo(T_world_frame, T_world_object) {
  const [a, b] = [T_world_frame, T_world_object];
  const from = [0, 1, 2].map((row) =>
    b[row].map((value, column) => (column === 3 ? value - a[row][3] : value)),
  );
  const turned = (row, column) => [0, 1, 2].reduce((sum, k) => sum + a[k][row] * from[k][column], 0);
  return [...[0, 1, 2].map((row) => [0, 1, 2, 3].map((column) => turned(row, column))), [0, 0, 0, 1]];
}

/** Unit quaternion [w, x, y, z], w >= 0, from the largest of its four components. */
function quaternion(/** @type {Matrix} */ T) {
  const [[a, b, c], [d, e, f], [g, h, i]] = T;
  const candidates = [
    [1 + a + e + i, h - f, c - g, d - b],
    [h - f, 1 + a - e - i, b + d, c + g],
    [c - g, b + d, 1 - a + e - i, f + h],
    [d - b, c + g, f + h, 1 - a - e + i],
  ];
  const [best] = candidates.toSorted((one, other) => Math.hypot(...other) - Math.hypot(...one));
  const scale = (best[0] < 0 ? -1 : 1) / Math.hypot(...best);
  return best.map((component) => component * scale);
}

function oneDecimal(number) {
  const text = number.toFixed(1);
  return text === "-0.0" ? "0.0" : text;
}

const NAMES = { x: 0, y: 1, z: 2, rx: 0, ry: 1, rz: 2 };

/**
 * T with one of its `poseNumbers` changed to `value` [mm or degrees], the others exactly as they were.
 *
 * @param {Matrix} T
 * @param {keyof typeof NAMES} name
 * @param {number} value
 */
export function withNumber(T, name, value) {
  const vector = name.startsWith("r") ? rotationVector(T) : T.slice(0, 3).map((row) => row[3]);
  vector[NAMES[name]] = name.startsWith("r") ? value / DEGREES : value / 1000;
  const rotation = name.startsWith("r") ? rotationMatrix(vector) : T;
  const position = name.startsWith("r") ? T.slice(0, 3).map((row) => row[3]) : vector;
  return [0, 1, 2].map((i) => [...rotation[i].slice(0, 3), position[i]]).concat([[0, 0, 0, 1]]);
}

/**
 * Product of two poses, or of two rotations.
 *
 * @param {Matrix} A
 * @param {Matrix} B
 */
export function product(A, B) {
  return A.map((row) => B[0].map((_, j) => row.reduce((sum, value, k) => sum + value * B[k][j], 0)));
}

/**
 * Rodrigues' formula: the matrix (3x3) of a rotation vector [rad].
 *
 * @param {Vector} vector
 */
export function rotationMatrix(vector) {
  const angle = Math.hypot(...vector);
  const [x, y, z] = vector.map((component) => component / (angle || 1));
  const [c, s, t] = [Math.cos(angle), Math.sin(angle), 1 - Math.cos(angle)];
  return [
    [c + t * x * x, t * x * y - s * z, t * x * z + s * y],
    [t * x * y + s * z, c + t * y * y, t * y * z - s * x],
    [t * x * z - s * y, t * y * z + s * x, c + t * z * z],
  ];
}
