/** The object alone, to be turned by a drag and pointed at by a click. */

import { distance, LARGEST_CLICK } from "../click.js";
import { rgb } from "../dom.js";
import { product, rotationMatrix } from "./pose.js";
import { firstHit } from "./ray.js";

const DISTANCE = 4; // from the object's middle, in its radii
const FILLED = 0.84; // share of the view's height that the object takes at most
const TURN = 0.01; // radians to a pixel of a drag
const KEY_TURN = Math.PI / 12;
const LARGEST_ZOOM = 8;
const ZOOM = 1.5; // for a hundred units of the wheel
const HIDDEN = 0.01; // in radii: a point so much behind the surface is not seen

/**
 * Shows the page's object (`objectDrawing`) in `canvas`; `onPoint(point)` gets what is clicked, metres, in the
 * object's frame, and `onTurn` is told when the view has changed. Returns null where the browser has no WebGL 2.
 */
export function objectView(canvas, { mesh, drawOn, drawUnder }, { onPoint, onTurn }) {
  if (!drawOn) return null;
  const { middle, radius } = sphereAround(mesh.vertices);
  let rotation = null; // of the object in the view's axes, 3x3
  let motion = null; // the pose that the object is drawn at in its own frame; null: where it rests
  let zoom = 1;
  let grip = null;
  let turned = false;

  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    grip = { pressed: event, last: event };
    turned = false;
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!grip) return;
    turned ||= distance(event, grip.pressed) > LARGEST_CLICK;
    if (turned) turn((event.clientX - grip.last.clientX) * TURN, (event.clientY - grip.last.clientY) * TURN);
    grip.last = event;
  });
  canvas.addEventListener("lostpointercapture", () => (grip = null));
  canvas.addEventListener("click", (event) => {
    if (turned) return;
    const point = pointUnder(event);
    if (point) onPoint(point);
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom = Math.min(Math.max(zoom * ZOOM ** (-event.deltaY / 100), 1), LARGEST_ZOOM);
    draw();
  });
  const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  canvas.addEventListener("keydown", (event) => {
    if (!KEYS[event.key]) return;
    event.preventDefault();
    turn(...KEYS[event.key].map((direction) => direction * KEY_TURN));
  });

  /** Looks at the object as it lies in the axes of a camera. */
  function look(T_camera_object) {
    rotation = T_camera_object.slice(0, 3).map((row) => row.slice(0, 3));
    zoom = 1;
    draw();
  }

  /** Turns the near side by so many radians to the right, and down. */
  function turn(right, down) {
    rotation = product(rotationMatrix([down, -right, 0]), rotation);
    draw();
  }

  /** Draws the object moved in its own frame, without turning the view; null puts it back to rest. */
  function move(T) {
    motion = T;
    draw();
  }

  /** What it takes to draw the object at rest over the same view. */
  function resting() {
    const unit = Math.min(devicePixelRatio, 2);
    return { camera: cameraFor(unit), T: poseInView(), unit };
  }

  function draw() {
    const unit = Math.min(devicePixelRatio, 2);
    canvas.width = Math.round(canvas.clientWidth * unit);
    canvas.height = Math.round(canvas.clientHeight * unit);
    const color = rgb(getComputedStyle(canvas).color);
    const T = motion ? product(poseInView(), motion) : poseInView();
    const camera = cameraFor(unit);
    drawOn(canvas, { camera, T, color, blend: drawUnder ? 0 : 1, unit });
    drawUnder?.(canvas, { camera, T });
    onTurn();
  }

  /** The pinhole camera; `unit` is the pixels of the picture in one of the page. */
  function cameraFor(unit) {
    const focal = (zoom * FILLED * canvas.clientHeight * Math.sqrt(DISTANCE ** 2 - 1)) / 2;
    const centre = (size) => (unit * size) / 2 - 0.5;
    return {
      fx: unit * focal,
      fy: unit * focal,
      cx: centre(canvas.clientWidth),
      cy: centre(canvas.clientHeight),
    };
  }

  function poseInView() {
    const ahead = [0, 0, DISTANCE * radius];
    return [...rotation.map((row, i) => [...row, ahead[i] - dot(row, middle)]), [0, 0, 0, 1]];
  }

  function pointUnder({ clientX, clientY }) {
    const box = canvas.getBoundingClientRect();
    const { fx, fy, cx, cy } = cameraFor(1);
    const pointed = [(clientX - box.left - 0.5 - cx) / fx, (clientY - box.top - 0.5 - cy) / fy, 1];
    const { origin, towards } = rayFrom(pointed);
    const far = firstHit(mesh, origin, towards);
    return far === null ? null : along(origin, towards, far);
  }

  /** A ray of the view's axes in the object's frame. */
  function rayFrom(direction) {
    const inObject = (vector) =>
      [0, 1, 2].map((k) => vector.reduce((sum, value, i) => sum + rotation[i][k] * value, 0));
    const toEye = inObject([0, 0, -DISTANCE * radius]);
    return { origin: middle.map((value, k) => value + toEye[k]), towards: inObject(direction) };
  }

  /** Where in the canvas a point of the object is [page pixels], and whether the object hides it. */
  function placeOf(point) {
    const [x, y, z] = inView(point);
    const { origin, towards } = rayFrom([x / z, y / z, 1]);
    const surface = firstHit(mesh, origin, towards) ?? z; // in steps of depth, since the ray's is 1
    return { ...projected(point), isHidden: surface < z - HIDDEN * radius };
  }

  /** The same place, without asking whether something hides it. */
  function projected(point) {
    const { fx, fy, cx, cy } = cameraFor(1);
    const [x, y, z] = inView(point);
    return { x: (fx * x) / z + cx + 0.5, y: (fy * y) / z + cy + 0.5 };
  }

  function inView(point) {
    return poseInView()
      .slice(0, 3)
      .map((row) => dot(row, point) + row[3]);
  }

  return { look, turn, move, resting, placeOf, projected, middle, radius };
}

const dot = (row, point) => row[0] * point[0] + row[1] * point[1] + row[2] * point[2];
const along = (origin, towards, far) => origin.map((value, k) => value + far * towards[k]);

/** A sphere around all vertices, about the middle of their box. */
function sphereAround(vertices) {
  const [low, high] = [Array(3).fill(Infinity), Array(3).fill(-Infinity)];
  for (let i = 0; i < vertices.length; i++) {
    low[i % 3] = Math.min(low[i % 3], vertices[i]);
    high[i % 3] = Math.max(high[i % 3], vertices[i]);
  }
  const middle = low.map((value, k) => (value + high[k]) / 2);
  let radius = 0;
  for (let i = 0; i < vertices.length; i += 3) {
    radius = Math.max(radius, Math.hypot(...middle.map((value, k) => vertices[i + k] - value)));
  }
  return { middle, radius };
}
