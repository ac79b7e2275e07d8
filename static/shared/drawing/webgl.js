/** What all drawing by WebGL shares: cameras as matrices, programs, sizes. */

export const NEAR = 0.01; // metres
const FAR = 100;

/**
 * From camera axes (x right, y down, z forward) to WebGL's clip space, row by row.
 *
 * @param {Intrinsics} intrinsics
 * @param {number} width
 * @param {number} height
 */
export function projection({ fx, fy, cx, cy }, width, height) {
  const depth = FAR - NEAR;
  return [
    [(2 * fx) / width, 0, (2 * cx + 1) / width - 1, 0],
    [0, (-2 * fy) / height, 1 - (2 * cy + 1) / height, 0],
    [0, 0, (FAR + NEAR) / depth, (-2 * FAR * NEAR) / depth],
    [0, 0, 1, 0],
  ];
}

/**
 * A 4x4 matrix as WebGL wants it.
 *
 * @param {Matrix} matrix
 */
export function columns(matrix) {
  return new Float32Array([0, 1, 2, 3].flatMap((column) => matrix.map((row) => row[column])));
}

/**
 * A program of these two shaders, and `at(name)`, where its uniforms are.
 *
 * @param {WebGL2RenderingContext} gl
 * @param {string} vertex
 * @param {string} fragment
 */
export function link(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const { kind, source } of [
    { kind: gl.VERTEX_SHADER, source: vertex },
    { kind: gl.FRAGMENT_SHADER, source: fragment },
  ]) {
    const shader = /** @type {WebGLShader} */ (gl.createShader(kind));
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new Error(`The object cannot be drawn: ${gl.getProgramInfoLog(program)}`);
  }
  const places = new Map(); // asking WebGL each time would wait for it
  const at = (name) => places.get(name) ?? places.set(name, gl.getUniformLocation(program, name)).get(name);
  return { program, at };
}

/**
 * Gives a canvas a size in pixels; only where it changes, since that wipes it.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {number} width
 * @param {number} height
 */
export function resize(canvas, width, height) {
  if (canvas.width !== width) canvas.width = width;
  if (canvas.height !== height) canvas.height = height;
}
