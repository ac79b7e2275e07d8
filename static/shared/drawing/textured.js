/** Draws the object in its own colours, as its texture or its vertices have them, by WebGL. */

import { sharedDrawing } from "./outline.js";
import { TEXTURED_FRAGMENT, TEXTURED_VERTEX } from "./shaders.js";
import { columns, link, projection, resize } from "./webgl.js";

let shared = null;

/**
 * What `sharedDrawing` gives of the page's object, and `drawUnder(canvas, {camera, T})`, which draws it in its own
 * colours under what a canvas shows already: null where it has none, or the browser no WebGL 2.
 *
 * @param {Pick<Rest["ObjectDetail"], "outline_mesh_url" | "textured_mesh_url">} object
 */
export async function objectDrawing({ outline_mesh_url: outline, textured_mesh_url: textured }) {
  shared ??= textured === null ? null : load(textured).then(drawingUnder);
  const [drawing, drawUnder] = await Promise.all([sharedDrawing(outline), shared]);
  return { ...drawing, drawUnder };
}

/** The mesh behind a `textured_mesh_url`: {vertices, faces}, and `colors` or {places, picture}. */
async function load(url) {
  const answer = await fetch(url);
  if (!answer.ok)
    throw new Error("The object's colours could not be loaded; load the page again to see them.");
  const content = await answer.arrayBuffer();
  const [vertexCount, faceCount, pictureSize] = new Uint32Array(content, 0, 3);
  let from = 12;
  const next = (Kind, count) => {
    const part = new Kind(content, from, count);
    from += part.byteLength;
    return part;
  };
  const mesh = { vertices: next(Float32Array, 3 * vertexCount), faces: next(Uint32Array, 3 * faceCount) };
  if (pictureSize === 0) return { ...mesh, colors: next(Uint8Array, 4 * vertexCount) };
  const places = next(Float32Array, 2 * vertexCount);
  return { ...mesh, places, picture: await createImageBitmap(new Blob([next(Uint8Array, pictureSize)])) };
}

function drawingUnder(mesh) {
  const hidden = document.createElement("canvas");
  const gl = hidden.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) return null;
  let program = setUp(gl, mesh);
  hidden.addEventListener("webglcontextlost", (event) => event.preventDefault());
  hidden.addEventListener("webglcontextrestored", () => (program = setUp(gl, mesh)));

  return function drawUnder(canvas, { camera, T }) {
    if (gl.isContextLost()) return;
    const { width, height } = canvas;
    resize(hidden, width, height);
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix4fv(program.at("cameraFromObject"), false, columns(T));
    gl.uniformMatrix4fv(program.at("projection"), false, columns(projection(camera, width, height)));
    gl.drawElements(gl.TRIANGLES, mesh.faces.length, gl.UNSIGNED_INT, 0);
    const context = canvas.getContext("2d");
    context.globalCompositeOperation = "destination-over";
    context.drawImage(hidden, 0, 0);
    context.globalCompositeOperation = "source-over";
  };
}

function setUp(gl, { vertices, faces, colors, places, picture }) {
  const program = link(gl, TEXTURED_VERTEX, TEXTURED_FRAGMENT);
  gl.useProgram(program.program);
  gl.enable(gl.DEPTH_TEST);
  gl.clearColor(0, 0, 0, 0);
  fill(gl, program, "position", vertices, 3, gl.FLOAT);
  if (colors) fill(gl, program, "color", colors, 4, gl.UNSIGNED_BYTE);
  else fill(gl, program, "place", places, 2, gl.FLOAT);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
  gl.uniform1i(program.at("hasPicture"), picture ? 1 : 0);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  const pixels = picture ?? new ImageData(1, 1);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  gl.generateMipmap(gl.TEXTURE_2D);
  return program;
}

function fill(gl, { program }, name, values, size, type) {
  const where = gl.getAttribLocation(program, name);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
  gl.enableVertexAttribArray(where);
  gl.vertexAttribPointer(where, size, type, type === gl.UNSIGNED_BYTE, 0, 0);
}
