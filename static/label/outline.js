/** Draws a mesh as a camera sees it, as an outline or as a shaded shape, by WebGL. */

const NEAR = 0.01; // metres
const FAR = 100;
const SAMPLES = 4;
const BLOCK = 16; // pixels: sizes are multiples, so that the levels of a mipmap average whole blocks

const SHAPE_VERTEX = `#version 300 es
uniform mat4 cameraFromObject;
uniform mat4 projection;
in vec3 position;
out vec3 place;
void main() {
  vec4 inCamera = cameraFromObject * vec4(position, 1.0);
  place = inCamera.xyz;
  gl_Position = projection * inCamera;
}`;

// Red is how much light comes back to the camera from a flat face, alpha how much of the pixel is covered.
const SHAPE_FRAGMENT = `#version 300 es
precision highp float;
in vec3 place;
out vec4 painted;
void main() {
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  float light = 0.3 + 0.7 * abs(dot(normal, normalize(place)));
  painted = vec4(light, 0.0, 0.0, 1.0);
}`;

const WHOLE_VERTEX = `#version 300 es
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(corner, 0.0, 1.0);
}`;

// The line lies inside the edge of the shape, so that the edge itself is where colour meets dark: a dark rim on
// either side lets it be read on any ground. Shrinking and growing the shape is a minimum and a maximum over
// discs. Far from the edge nothing needs to be looked for: there the blocks of pixels around are all of one kind.
const OUTLINE_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D shape;
uniform ivec2 size;
uniform vec3 color;
uniform float blend;
uniform float unit;
out vec4 painted;
const float LINE = 2.5, RIM = 1.5;
float cover(int x, int y, int level) {
  ivec2 there = clamp(ivec2(gl_FragCoord.xy) + ivec2(x, y), ivec2(0), size - 1);
  return texelFetch(shape, there >> level, level).a;
}
void main() {
  vec4 seen = texelFetch(shape, ivec2(gl_FragCoord.xy), 0);
  painted = blend * vec4(color * seen.r, seen.a);
  int reach = int(ceil((LINE + RIM) * unit));
  int level = reach > 4 ? 4 : 3;
  float around = cover(-reach, -reach, level) + cover(reach, -reach, level) + cover(-reach, reach, level)
    + cover(reach, reach, level);
  if (around == 0.0 || around == 4.0) return;
  float grown = seen.a, withoutLine = seen.a, withoutRim = seen.a;
  for (int y = -reach; y <= reach; y++) {
    for (int x = -reach; x <= reach; x++) {
      float near = cover(x, y, 0);
      float away = length(vec2(x, y)) - 0.5;
      grown = max(grown, near * clamp(RIM * unit - away, 0.0, 1.0));
      withoutLine = min(withoutLine, mix(1.0, near, clamp(LINE * unit - away, 0.0, 1.0)));
      withoutRim = min(withoutRim, mix(1.0, near, clamp((LINE + RIM) * unit - away, 0.0, 1.0)));
    }
  }
  float rim = 0.75 * (grown - seen.a) + 0.4 * (withoutLine - withoutRim);
  float line = seen.a - withoutLine;
  painted = painted * (1.0 - rim) + vec4(0.0, 0.0, 0.0, rim);
  painted = painted * (1.0 - line) + vec4(color * line, line);
}`;

let shared = null;

/** The mesh of the page's object and what draws it, {mesh, drawMesh}: one for all who show it. */
export function sharedDrawing(url) {
  return (shared ??= loadMesh(url).then((mesh) => ({ mesh, drawMesh: meshDrawing(mesh) })));
}

/** The mesh {vertices, faces} behind the `outline_mesh_url` of an object. */
async function loadMesh(url) {
  const answer = await fetch(url);
  if (!answer.ok) throw new Error("The object's mesh could not be loaded; load the page again to see its outline.");
  const content = await answer.arrayBuffer();
  const [vertexCount, faceCount] = new Uint32Array(content, 0, 2);
  const vertices = new Float32Array(content, 8, 3 * vertexCount);
  return { vertices, faces: new Uint32Array(content, 8 + vertices.byteLength, 3 * faceCount) };
}

/** The pinhole camera of a picture that is shown `scale` times as large, its corner at (left, top) of a canvas. */
export function shownCamera({ fx, fy, cx, cy }, { scale, left, top }) {
  // (0, 0) is the centre of the first pixel, in the picture as on the canvas.
  const along = (centre, corner) => scale * (centre + 0.5) + corner - 0.5;
  return { fx: scale * fx, fy: scale * fy, cx: along(cx, left), cy: along(cy, top) };
}

/** The box {left, top, right, bottom} around a mesh in the picture [pixels from its corner]; null where behind. */
export function extentInPicture({ vertices }, T, { fx, fy, cx, cy }) {
  const box = { left: Infinity, top: Infinity, right: -Infinity, bottom: -Infinity };
  for (let i = 0; i < vertices.length; i += 3) {
    const [x, y, z] = [0, 1, 2].map(
      (row) => T[row][0] * vertices[i] + T[row][1] * vertices[i + 1] + T[row][2] * vertices[i + 2] + T[row][3],
    );
    if (z < NEAR) continue;
    const [u, v] = [(fx * x) / z + cx + 0.5, (fy * y) / z + cy + 0.5];
    box.left = Math.min(box.left, u);
    box.right = Math.max(box.right, u);
    box.top = Math.min(box.top, v);
    box.bottom = Math.max(box.bottom, v);
  }
  return box.left < box.right && box.top < box.bottom ? box : null;
}

/**
 * What draws a mesh, or null where the browser has no WebGL 2.
 *
 * The function returned paints over a canvas {camera, T, color, blend, unit}: the pinhole camera in pixels of
 * the canvas, T_camera_object in metres, the colour as [red, green, blue] from 0 to 1, `blend` from 0 (the
 * outline alone) to 1 (the shape hides what is below), and the pixels of the canvas in one of the page, up to 2. All
 * canvases share one hidden WebGL canvas, since a browser allows only a few.
 */
function meshDrawing({ vertices, faces }) {
  const hidden = document.createElement("canvas");
  const gl = hidden.getContext("webgl2", { antialias: false, depth: false });
  if (!gl) return null;
  let programs = setUp(gl, vertices, faces);
  let buffers = null;
  hidden.addEventListener("webglcontextlost", (event) => event.preventDefault());
  hidden.addEventListener("webglcontextrestored", () => {
    programs = setUp(gl, vertices, faces);
    buffers = null;
  });

  function makeRoom(width, height) {
    if (buffers && hidden.width >= width && hidden.height >= height) return;
    hidden.width = Math.max(hidden.width, BLOCK * Math.ceil(width / BLOCK));
    hidden.height = Math.max(hidden.height, BLOCK * Math.ceil(height / BLOCK));
    if (buffers) freeBuffers(gl, buffers);
    buffers = makeBuffers(gl, hidden.width, hidden.height);
  }

  function drawShape({ camera, T }, width, height) {
    const { shape } = programs;
    gl.bindFramebuffer(gl.FRAMEBUFFER, buffers.sampled);
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(shape.program);
    gl.uniformMatrix4fv(shape.at("cameraFromObject"), false, columns(T));
    gl.uniformMatrix4fv(shape.at("projection"), false, columns(projection(camera, width, height)));
    gl.drawElements(gl.TRIANGLES, faces.length, gl.UNSIGNED_INT, 0);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, buffers.sampled);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, buffers.resolved);
    const all = [0, 0, hidden.width, hidden.height];
    gl.blitFramebuffer(...all, ...all, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    gl.generateMipmap(gl.TEXTURE_2D);
  }

  function drawOutline({ color, blend, unit }, width, height) {
    const { outline } = programs;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.DEPTH_TEST);
    gl.useProgram(outline.program);
    gl.uniform2i(outline.at("size"), width, height);
    gl.uniform3fv(outline.at("color"), color);
    gl.uniform1f(outline.at("blend"), blend);
    gl.uniform1f(outline.at("unit"), unit);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  return function draw(canvas, drawn) {
    const { width, height } = canvas;
    if (gl.isContextLost()) return;
    makeRoom(width, height);
    drawShape(drawn, width, height);
    drawOutline(drawn, width, height);
    const context = canvas.getContext("2d");
    context.clearRect(0, 0, width, height);
    context.drawImage(hidden, 0, hidden.height - height, width, height, 0, 0, width, height);
  };
}

/** From camera axes (x right, y down, z forward) to WebGL's clip space, row by row. */
function projection({ fx, fy, cx, cy }, width, height) {
  const depth = FAR - NEAR;
  return [
    [(2 * fx) / width, 0, (2 * cx + 1) / width - 1, 0],
    [0, (-2 * fy) / height, 1 - (2 * cy + 1) / height, 0],
    [0, 0, (FAR + NEAR) / depth, (-2 * FAR * NEAR) / depth],
    [0, 0, 1, 0],
  ];
}

/** A 4x4 matrix as WebGL wants it. */
function columns(matrix) {
  return new Float32Array([0, 1, 2, 3].flatMap((column) => matrix.map((row) => row[column])));
}

function setUp(gl, vertices, faces) {
  const shape = link(gl, SHAPE_VERTEX, SHAPE_FRAGMENT);
  const outline = link(gl, WHOLE_VERTEX, OUTLINE_FRAGMENT);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.STATIC_DRAW);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
  const position = gl.getAttribLocation(shape.program, "position");
  gl.enableVertexAttribArray(position);
  gl.vertexAttribPointer(position, 3, gl.FLOAT, false, 0, 0);
  return { shape, outline };
}

function link(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, source] of [
    [gl.VERTEX_SHADER, vertex],
    [gl.FRAGMENT_SHADER, fragment],
  ]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new Error(`The outline cannot be drawn: ${gl.getProgramInfoLog(program)}`);
  }
  return { program, at: (name) => gl.getUniformLocation(program, name) };
}

/** A framebuffer with several samples a pixel, and one with a texture that they are averaged into. */
function makeBuffers(gl, width, height) {
  const [color, depth] = [gl.RGBA8, gl.DEPTH_COMPONENT24].map((format) => {
    const store = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, store);
    gl.renderbufferStorageMultisample(gl.RENDERBUFFER, SAMPLES, format, width, height);
    return store;
  });
  const sampled = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, sampled);
  gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, color);
  gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);

  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texStorage2D(gl.TEXTURE_2D, 1 + Math.log2(BLOCK), gl.RGBA8, width, height);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST_MIPMAP_NEAREST);
  const resolved = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, resolved);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
  return { sampled, resolved, color, depth, texture };
}

function freeBuffers(gl, { sampled, resolved, color, depth, texture }) {
  for (const framebuffer of [sampled, resolved]) gl.deleteFramebuffer(framebuffer);
  for (const store of [color, depth]) gl.deleteRenderbuffer(store);
  gl.deleteTexture(texture);
}
