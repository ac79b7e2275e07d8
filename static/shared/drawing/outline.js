/** Draws a mesh as a camera sees it, as an outline or as a shaded shape, by WebGL. */

import { OUTLINE_FRAGMENT, SHAPE_FRAGMENT, SHAPE_VERTEX, WHOLE_VERTEX } from "./shaders.js";
import { columns, link, NEAR, projection, resize } from "./webgl.js";

const SAMPLES = 4;
const DEPTH_UNIT = 1; // of the textures; 0 is the shape
const BLOCK = 16; // pixels: sizes are multiples, so that the levels of a mipmap average whole blocks

let shared = null;

/**
 * The page's object, {mesh, drawOn}: its mesh, and what `meshCopying` makes of it; one for all who show it.
 *
 * @param {string} url
 */
export function sharedDrawing(url) {
  shared ??= loadMesh(url).then((mesh) => ({ mesh, drawOn: meshCopying(mesh) }));
  return shared;
}

/** The mesh {vertices, faces} behind the `outline_mesh_url` of an object. */
async function loadMesh(url) {
  const answer = await fetch(url);
  if (!answer.ok)
    throw new Error("The object's mesh could not be loaded; load the page again to see its outline.");
  const content = await answer.arrayBuffer();
  const [vertexCount, faceCount] = new Uint32Array(content, 0, 2);
  const vertices = new Float32Array(content, 8, 3 * vertexCount);
  return { vertices, faces: new Uint32Array(content, 8 + vertices.byteLength, 3 * faceCount) };
}

/**
 * The pinhole camera of a picture that is shown `scale` times as large, its corner at (left, top) of a canvas.
 *
 * @param {Intrinsics} intrinsics
 * @param {Shown} shown
 */
export function shownCamera({ fx, fy, cx, cy }, { scale, left, top }) {
  // (0, 0) is the centre of the first pixel, in the picture as on the canvas.
  const along = (centre, corner) => scale * (centre + 0.5) + corner - 0.5;
  return { fx: scale * fx, fy: scale * fy, cx: along(cx, left), cy: along(cy, top) };
}

/**
 * The box {left, top, right, bottom} around a mesh in the picture [pixels from its corner]; null where behind.
 *
 * @param {Pick<Mesh, "vertices">} mesh
 * @param {Matrix} T
 * @param {Intrinsics} intrinsics
 */
export function extentInPicture({ vertices }, T, { fx, fy, cx, cy }) {
  const box = { left: Infinity, top: Infinity, right: -Infinity, bottom: -Infinity };
  for (let i = 0; i < vertices.length; i += 3) {
    const [x, y, z] = [0, 1, 2].map(
      (row) =>
        T[row][0] * vertices[i] + T[row][1] * vertices[i + 1] + T[row][2] * vertices[i + 2] + T[row][3],
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
 * What draws a mesh on a canvas by WebGL, or null where the browser has no WebGL 2.
 *
 * The function returned paints {width, height, camera, T, color, blend, unit, depth}: the canvas' lower left pixels
 * that are painted, the pinhole camera in pixels of the canvas, T_camera_object in metres, the colour as [red, green,
 * blue] from 0 to 1, `blend` from 0 (the outline alone) to 1 (the shape hides what is below), the pixels of the
 * canvas in one of the page, up to 2, and the depth image of `loadDepth` with its `verdicts` (four colours: no data,
 * match, in front, behind), where the shape is to show how depth agrees with it.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {Mesh} mesh
 */
export function meshDrawing(canvas, { vertices, faces }) {
  // What was drawn is kept, so that it can be copied and a page at rest draws nothing.
  const context = canvas.getContext("webgl2", {
    antialias: false,
    depth: false,
    preserveDrawingBuffer: true,
  });
  if (!context) return null;
  const gl = context;
  let programs = setUp(gl, vertices, faces);
  let buffers = null;
  let depthThere = null;
  canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", () => {
    programs = setUp(gl, vertices, faces);
    buffers = null;
    depthThere = null;
  });

  function makeRoom(width, height) {
    if (buffers && buffers.width >= width && buffers.height >= height) return;
    if (buffers) freeBuffers(gl, buffers);
    const [wide, high] = [width, height].map((size) => BLOCK * Math.ceil(size / BLOCK));
    buffers = { width: wide, height: high, ...makeBuffers(gl, wide, high) };
  }

  function drawShape({ camera, T, depth, width, height }) {
    const { shape } = programs;
    if (depth && depth !== depthThere) {
      fillDepth(gl, depth);
      depthThere = depth;
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, buffers.sampled);
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(shape.program);
    gl.uniformMatrix4fv(shape.at("cameraFromObject"), false, columns(T));
    gl.uniformMatrix4fv(shape.at("projection"), false, columns(projection(camera, width, height)));
    gl.uniform1i(shape.at("measured"), DEPTH_UNIT);
    gl.uniform1f(shape.at("unitOfDepth"), depth?.metres ?? 0);
    gl.uniform1f(shape.at("tolerance"), depth?.tolerance ?? 0);
    gl.uniform4fv(shape.at("sensor"), depth?.sensor ?? [1, 1, 0, 0]);
    gl.drawElements(gl.TRIANGLES, faces.length, gl.UNSIGNED_INT, 0);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, buffers.sampled);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, buffers.resolved);
    const all = /** @type {const} */ ([0, 0, buffers.width, buffers.height]);
    gl.blitFramebuffer(...all, ...all, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    gl.generateMipmap(gl.TEXTURE_2D);
  }

  function drawOutline({ color, blend, unit, depth, width, height }) {
    const { outline } = programs;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.DEPTH_TEST);
    gl.useProgram(outline.program);
    gl.uniform2i(outline.at("size"), width, height);
    gl.uniform3fv(outline.at("color"), color);
    gl.uniform1f(outline.at("blend"), blend);
    gl.uniform1f(outline.at("unit"), unit);
    gl.uniform1i(outline.at("isJudged"), depth ? 1 : 0);
    if (depth) gl.uniform3fv(outline.at("verdicts"), depth.verdicts.flat());
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  return function draw(drawn) {
    if (gl.isContextLost()) return;
    makeRoom(drawn.width, drawn.height);
    drawShape(drawn);
    drawOutline(drawn);
  };
}

/**
 * What draws a mesh on many canvases, {camera, T, ...} each, by one hidden WebGL canvas, since a browser allows only a
 * few; or null. Copying waits for all that WebGL still has to do: not for what follows the mouse.
 *
 * @param {Mesh} mesh
 */
export function meshCopying(mesh) {
  const hidden = document.createElement("canvas");
  const draw = meshDrawing(hidden, mesh);
  if (!draw) return null;
  return function drawOn(canvas, drawn) {
    const { width, height } = canvas;
    resize(hidden, Math.max(hidden.width, width), Math.max(hidden.height, height));
    draw({ width, height, ...drawn });
    const context = canvas.getContext("2d");
    context.clearRect(0, 0, width, height);
    context.drawImage(hidden, 0, hidden.height - height, width, height, 0, 0, width, height);
  };
}

/** Puts a depth image where shaders read it. */
function fillDepth(gl, { raw, width, height }) {
  gl.activeTexture(gl.TEXTURE0 + DEPTH_UNIT);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.R16UI, width, height, 0, gl.RED_INTEGER, gl.UNSIGNED_SHORT, raw);
  gl.activeTexture(gl.TEXTURE0);
}

/** Makes room for a depth image: one pixel without data. */
function makeDepth(gl) {
  gl.activeTexture(gl.TEXTURE0 + DEPTH_UNIT);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  fillDepth(gl, { raw: new Uint16Array(1), width: 1, height: 1 });
}

function setUp(gl, vertices, faces) {
  const shape = link(gl, SHAPE_VERTEX, SHAPE_FRAGMENT);
  const outline = link(gl, WHOLE_VERTEX, OUTLINE_FRAGMENT);
  makeDepth(gl);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.STATIC_DRAW);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
  const position = gl.getAttribLocation(shape.program, "position");
  gl.enableVertexAttribArray(position);
  gl.vertexAttribPointer(position, 3, gl.FLOAT, false, 0, 0);
  return { shape, outline };
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
