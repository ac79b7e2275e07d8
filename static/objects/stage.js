/** The object in 3-D: turned by hand or slowly by itself, with its axes, and moved by a symmetry's turns. */

import { rgb, svg } from "../shared/dom.js";
import { objectView } from "../shared/drawing/object-view.js";
import { rotationMatrix } from "../shared/drawing/pose.js";

const FIRST_EYE = [0.5, -0.75, 0.43]; // seen from the object: its x goes to the right and towards us, z up
const SPIN = 0.5; // radians a second
const TURN_SECONDS = 1.4;
const REST_SECONDS = 0.8; // after each turn, to be compared with what was there before
const FREE_TURN = 0.9; // radians a second, where any angle will do
const REACH = 1.12; // of a drawn axis to either side of the middle, in radii
const DEGREES = 180 / Math.PI;

/**
 * Shows `drawing` (of `objectDrawing`) on `canvas`; over it, on `rest`, the outline of the object at rest while a turn
 * is played, and its axes in the SVG `axes`. `onPoint` gets points clicked on the object at rest, `onTurned` the
 * degrees while a turn is played, null when it ends. Null where the browser has no WebGL 2.
 */
export function stageOf({ canvas, rest, axes }, drawing, { size, centre }, { onPoint, onTurned, onGrasp }) {
  const drawn = objectView(canvas, drawing, {
    onPoint: (point) => playing || onPoint(point),
    onTurn: drawAround,
  });
  if (drawn === null) return null;
  const view = drawn;
  let shown = []; // axes of symmetry: {axis, point, label, kind}
  let points = [];
  let playing = null; // {axis, since}
  let spinning = null; // when the view was turned last
  canvas.addEventListener("pointerdown", onGrasp);
  new ResizeObserver(() => view.turn(0, 0)).observe(canvas);

  /** Plays the turns of an axis again and again, until `stop`. */
  function play(axis) {
    playing = { axis, since: performance.now() };
    requestAnimationFrame(step);
  }

  function stop() {
    if (!playing) return;
    playing = null;
    view.move(null);
    onTurned(null);
  }

  function step(now) {
    if (!playing) return;
    const { axis, since } = playing;
    const angle = angleAt(Math.max(0, (now - since) / 1000), axis.fold);
    view.move(turnAbout(axis, angle));
    onTurned((angle * DEGREES) % 360);
    requestAnimationFrame(step);
  }

  /** Lets the view go around the object, or stand still. */
  function spin(on) {
    spinning = on ? performance.now() : null;
    if (on) requestAnimationFrame(goAround);
  }

  function goAround(now) {
    if (spinning === null) return;
    view.turn((SPIN * Math.max(0, now - spinning)) / 1000, 0);
    spinning = now;
    requestAnimationFrame(goAround);
  }

  function show(wanted, marked = []) {
    shown = wanted;
    points = marked;
    drawAround();
  }

  function drawAround() {
    drawRest();
    axes.replaceChildren(...[0, 1, 2].flatMap(ruler), ...shown.flatMap(drawnAxis), ...points.map(drawnPoint));
  }

  function drawRest() {
    rest.width = canvas.width;
    rest.height = canvas.height;
    if (!playing) return;
    drawing.drawOn(rest, { ...view.resting(), color: rgb(getComputedStyle(rest).color), blend: 0 });
  }

  /** The size along an axis of the mesh, as a line through the middle of its box. */
  function ruler(k) {
    const end = (sign) => centre.map((value, i) => value + (i === k ? (sign * size[k]) / 2 : 0));
    const label = `${"xyz"[k]} ${(1000 * size[k]).toFixed(1)} mm`;
    return [line(end(-1), end(1), "ruler"), text(end(1), label, "ruler")];
  }

  function drawnAxis({ axis, point, label, kind }) {
    const along = axis.reduce((sum, value, k) => sum + value * (view.middle[k] - point[k]), 0);
    const end = (sign) => point.map((value, k) => value + (along + sign * REACH * view.radius) * axis[k]);
    const kinds = isPlayed({ axis, point }) ? `${kind} played` : kind;
    return [line(end(-1), end(1), kinds), text(end(1), label, kinds)];
  }

  function isPlayed({ axis, point }) {
    return playing !== null && `${[axis, point]}` === `${[playing.axis.axis, playing.axis.point]}`;
  }

  function drawnPoint(point) {
    const { x, y } = view.projected(point);
    return svg("circle", { cx: x, cy: y, r: 5, class: "picked" });
  }

  function line(from, to, kind) {
    const [a, b] = [view.projected(from), view.projected(to)];
    return svg("line", { x1: a.x, y1: a.y, x2: b.x, y2: b.y, class: kind });
  }

  function text(at, content, kind) {
    const [{ x, y }, middle] = [view.projected(at), view.projected(centre)];
    const anchor = Math.abs(x - middle.x) < 12 ? "middle" : x < middle.x ? "end" : "start";
    const beside = anchor === "middle" ? 0 : anchor === "end" ? -6 : 6;
    return svg(
      "text",
      { x: x + beside, y: y + (y < middle.y ? -5 : 12), "text-anchor": anchor, class: kind },
      content,
    );
  }

  view.look(seenFrom(FIRST_EYE));
  return { play, stop, spin, show };
}

/** The axes of a camera (right, down, forward) as rows, which looks at the object from a direction; z is up. */
function seenFrom(eye) {
  const length = Math.hypot(...eye);
  const forward = eye.map((value) => -value / length);
  const [x, y] = forward;
  const right = [y, -x, 0].map((value) => value / Math.hypot(x, y));
  return [right, cross(forward, right), forward];
}

const cross = (/** @type {Vector} */ [a, b, c], /** @type {Vector} */ [d, e, f]) => [
  b * f - c * e,
  c * d - a * f,
  a * e - b * d,
];

/** How far a fold has turned after so many seconds: turn by turn, with rests. */
function angleAt(seconds, fold) {
  if (fold === null) return FREE_TURN * seconds;
  const length = TURN_SECONDS + REST_SECONDS;
  const share = Math.min(1, (seconds % length) / TURN_SECONDS);
  const eased = share * share * (3 - 2 * share);
  return ((2 * Math.PI) / fold) * (Math.floor(seconds / length) + eased);
}

/** The pose of an object turned about an axis: p -> R (p - o) + o. */
function turnAbout({ axis, point }, angle) {
  const R = rotationMatrix(axis.map((value) => value * angle));
  const shift = (row, i) => point[i] - row.reduce((sum, value, k) => sum + value * point[k], 0);
  return [...R.map((row, i) => [...row, shift(row, i)]), [0, 0, 0, 1]];
}
