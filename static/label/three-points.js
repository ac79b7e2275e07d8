/** Three points: the object is placed by points clicked on it and, in the same order, in the cloud or the image. */

import { post, put } from "../shared/api.js";
import { byId, element, icon, setText } from "../shared/dom.js";
import { objectView } from "../shared/drawing/object-view.js";
import { relativeTo } from "../shared/drawing/pose.js";
import { objectDrawing } from "../shared/drawing/textured.js";
import { drawMarks } from "./marks.js";
import { placeOfPixel, scenePointing } from "./pointing.js";

const LEAST = 3;

/**
 * A part of the labelling page.
 *
 * @param {LabelPage} page
 * @returns {Part}
 */
export function threePointsPart(page) {
  const button = byId("three-points");
  const pointing = scenePointing(page, pickInScene);
  const picked = { object: [], scene: [] }; // points in the object's frame and in the world, metres
  let order = []; // of the clicks: "object" or "scene"
  let fit = null; // {residuals, rms} of the complete pairs, from three on
  let on = false;
  let view = null;
  let frames = [];
  let object = null;
  let marking = Promise.resolve();
  let fitting = Promise.resolve();

  button.addEventListener("click", () => use(!on));
  byId("pairs-leave").addEventListener("click", leave);
  byId("pairs-back").addEventListener("click", takeBack);

  function open(_task, scene, itsObject) {
    frames = scene.frames;
    object = itsObject;
  }

  const isOpen = () => page.registration()?.state === "open";
  const complete = () => Math.min(picked.object.length, picked.scene.length);

  async function use(wanted) {
    if (wanted === on || (wanted && !(page.canMove() && object))) return;
    if (wanted) page.leaveMode();
    on = wanted;
    button.setAttribute("aria-pressed", on);
    if (!on) byId("pairs").hidden = true;
    pointing.use(on);
    forget();
    if (on) await showObject().catch(cannotShow);
  }

  async function showObject() {
    const drawing = await objectDrawing(object); // who opens it twice meanwhile gets one view all the same
    view ??= objectView(byId("pairs-object"), drawing, { onPoint: pickOnObject, onTurn: markObject });
    if (view === null)
      throw new Error("Without WebGL 2 the object cannot be shown: no points can be clicked on it.");
    if (!on) return;
    byId("pairs").hidden = false;
    view.look(page.registration().T_camera_object);
    markImage();
  }

  function cannotShow(error) {
    leave();
    page.message.problem(error);
  }

  /** True if there was something to leave. */
  function leave() {
    const was = on;
    use(false);
    return was;
  }

  function forget() {
    order = [];
    picked.object.length = picked.scene.length = 0;
    fit = null;
    changed();
  }

  function pickOnObject(point) {
    if (on) pick("object", point);
  }

  async function pickInScene(pointed) {
    page.message.clear();
    try {
      const { point_world: point } = await post(page.path("point"), pointed);
      if (on) pick("scene", point);
    } catch (error) {
      page.message.problem(error);
    }
  }

  function pick(side, point) {
    page.message.clear();
    const before = complete();
    picked[side].push(point);
    order.push(side);
    changed();
    if (complete() !== before) fitAgain();
  }

  function takeBack() {
    if (!on || !order.length) return;
    const before = complete();
    picked[order.pop()].pop();
    changed();
    if (complete() !== before) fitAgain();
  }

  function takeOut(index) {
    for (const side of ["object", "scene"]) {
      picked[side].splice(index, 1);
      order.splice(order.lastIndexOf(side), 1);
    }
    changed();
    fitAgain();
  }

  /** One at a time: the answer to fewer pairs must not come last. */
  function fitAgain() {
    fit = null;
    fitting = fitting.then(fitPairs);
  }

  async function fitPairs() {
    const pairs = picked.object
      .slice(0, complete())
      .map((onObject, index) => ({ on_object: onObject, in_scene: picked.scene[index] }));
    if (pairs.length >= LEAST) {
      page.message.clear();
      fit = await post(page.path("three-points"), { pairs }).catch(page.message.problem);
    }
    drawPairs();
  }

  function changed() {
    drawPairs();
    markObject();
    marking = marking.then(markScene);
  }

  /** One at a time, like fits: marks that were taken back must not come last. */
  async function markScene() {
    if (page.isConnected())
      await put(page.path("marks"), { points_world: picked.scene }).catch(page.message.problem);
  }

  function drawPairs() {
    setText(byId("pairs-next"), nextStep());
    byId("pairs-back").disabled = !order.length;
    byId("pair-list").replaceChildren(...Array.from({ length: complete() }, (_, index) => pairRow(index)));
    byId("pairs-rms").hidden = !fit;
    if (fit) setText(byId("pairs-rms"), `The pairs agree to ${millimetres(fit.rms)} (rms).`);
  }

  function pairRow(index) {
    const residual = fit?.residuals[index];
    const out = element("button", { type: "button", className: "button quiet square" }, icon("close"));
    out.setAttribute("aria-label", `Take pair ${index + 1} out`);
    out.title = out.ariaLabel ?? "";
    out.addEventListener("click", () => takeOut(index));
    const number = element("span", { className: "pair-number" }, `${index + 1}`);
    const off = element(
      "span",
      {},
      residual === undefined ? "both sides clicked" : `${millimetres(residual)} off`,
    );
    return element("li", {}, number, off, out);
  }

  function nextStep() {
    const { object, scene } = picked;
    if (fit && object.length === scene.length) return "In place. Another pair makes it more exact.";
    const side = object.length <= scene.length ? object : scene;
    const number = side.length + 1;
    if (side === object) return `Click point ${number} on the object, here below.`;
    return `Click point ${number}, the same place, in the cloud or the image.`;
  }

  function markObject() {
    drawMarks(byId("object-marks"), on && view ? picked.object.map(view.placeOf) : []);
  }

  /** The image may be moved and zoomed at any time: its marks follow, as long as there are any. */
  function markImage() {
    drawMarks(byId("image-marks"), on ? placesInImage() : []);
    if (on) requestAnimationFrame(markImage);
  }

  function placesInImage() {
    const image = byId("color");
    const box = byId("image-marks").getBoundingClientRect();
    const frame = frames.find(({ id }) => id === page.registration().frame_id);
    if (image.hidden || !frame) return [];
    return picked.scene.map((point) => {
      const { fx, fy, cx, cy } = frame.intrinsics;
      const [x, y, z] = inCamera(frame.T_world_camera, point);
      const place = placeOfPixel(image, (fx * x) / z + cx, (fy * y) / z + cy);
      return { x: place.x - box.left, y: place.y - box.top, isHidden: z <= 0 };
    });
  }

  function draw() {
    button.disabled = !isOpen() || !page.isConnected();
    if (!isOpen()) leave();
  }

  const bindings = [
    {
      keys: ["T"],
      does: "Place the object by three points; Esc leaves this",
      run: () => use(!on),
      tool: "three points",
    },
    {
      keys: ["Backspace"],
      does: "Three points: take the last click back",
      run: takeBack,
      tool: "three points",
    },
  ];
  return { title: "The object", bindings, open, attach: pointing.attach, leave, draw };
}

function inCamera(T_world_camera, point) {
  const T_world_point = [0, 1, 2].map((row) => [0, 0, 0, point[row]]);
  return relativeTo(T_world_camera, T_world_point).map((row) => row[3]);
}

function millimetres(metres) {
  return `${(1000 * metres).toFixed(1)} mm`;
}
