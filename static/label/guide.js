/** The first task, step by step: one hint at a time, checked off when what it asks for has happened. */

import { byId, element, setText } from "../shared/dom.js";
import { MOD } from "../shared/keys.js";

const TURNED = 30; // page pixels of a drag beside the object that turn the view visibly

const CAMERA_KEYS = /^(Key[WASDQE]|Arrow\w+)$/; // viser's own

/**
 * @typedef {{
 *   name: string,
 *   text: string,
 *   byKeys?: { tool: string, text: string },
 *   isDone?: (now: Registration, before: Registration) => boolean,
 *   tool?: string,
 * }} GuideStep
 */

/**
 * In order; each can be done by mouse and by keys. `text` has keys in backticks, and `byKeys` follows it where
 * there are those keys; `isDone(now, before)` compares two states of the registration. What the server does not
 * know of, the view and the image, is told by `check(name)` below.
 */
/** @type {GuideStep[]} */
const STEPS = [
  {
    name: "move",
    text: "Drag one of the object's arrows: it moves that way. Squares move it in a plane, arcs turn it.",
    byKeys: { tool: "precision", text: " Or press `J` `L` `I` `K` `U` `O`; with `Shift` they turn it." },
    isDone: (now, before) => now.can_undo && !now.dragging && (before.dragging || isElsewhere(now, before)),
  },
  {
    name: "turn",
    text: "Turn the view: drag beside the object, or press `9` or `0`. The wheel comes closer, and so does `4`.",
  },
  {
    name: "snap",
    text: "Bring the object roughly to its points, then press `Space`: the machine snaps it into place.",
    isDone: (now, before) => now.snap?.state === "done" && before.snap?.state !== "done",
    tool: "snap",
  },
  {
    name: "image",
    text: "Press `Z`: the image comes closer. Where the pose is right, the outline follows the edge.",
  },
  {
    name: "undo",
    text: `Press \`${MOD} Z\`: whatever was done, by you or the machine, can be undone.`,
    isDone: (now, before) => now.can_redo && !before.can_redo,
  },
  {
    name: "redo",
    text: `Press \`${MOD} Shift Z\`, and it comes back.`,
    isDone: (now, before) => before.can_redo && !now.can_redo,
  },
  {
    name: "submit",
    text: "Does it lie on its points from every side? Then press `Enter` to submit it.",
    isDone: (now, before) => now.state === "submitted" && before.state === "open",
  },
];
const END = "That is all you need. `?` shows every key, and this tour again.";

/**
 * A part of the labelling page.
 *
 * @param {LabelPage} page
 * @returns {Part}
 */
export function guidePart(page) {
  const done = new Set();
  let steps = STEPS;
  let isOn = false;

  byId("guide-skip").addEventListener("click", stop);
  byId("guide-start").addEventListener("click", () => {
    byId("keys").close();
    done.clear();
    start();
  });
  byId("image").addEventListener("zoomed", () => check("image"));
  byId("view").addEventListener("looked", () => check("turn"));

  /** Somebody who has submitted nothing yet is shown around, but once. */
  function open() {
    if (page.isTrial()) return; // there, everybody is told the same
    steps = STEPS.filter(({ tool }) => !tool || page.has(tool));
    const remembered = JSON.parse(localStorage.getItem(key()) ?? "null");
    for (const name of remembered?.done ?? []) done.add(name);
    if (remembered ? remembered.isOn : page.me().submitted === 0) start();
  }

  const textOf = (/** @type {GuideStep} */ { text, byKeys }) =>
    text + (byKeys && page.has(byKeys.tool) ? byKeys.text : "");
  const key = () => `snap6d.guide.${page.me().id}`;
  const remember = () => localStorage.setItem(key(), JSON.stringify({ isOn, done: [...done] }));

  function start() {
    isOn = true;
    show();
  }

  function stop() {
    isOn = false;
    show();
  }

  function draw(now, before) {
    for (const { name, isDone } of steps) if (before && isDone?.(now, before)) check(name);
  }

  function check(name) {
    if (!isOn || done.has(name)) return;
    done.add(name);
    show();
  }

  function show() {
    const next = steps.find(({ name }) => !done.has(name));
    byId("guide").hidden = !isOn;
    byId("guide-text").replaceChildren(...withKeys(next ? textOf(next) : END));
    byId("guide-steps").replaceChildren(...steps.map((step) => mark(done.has(step.name), step === next)));
    setText(byId("guide-place"), next ? `${steps.indexOf(next) + 1} of ${steps.length}` : "Done");
    setText(byId("guide-skip"), next ? "Skip" : "Close");
    if (!next) isOn = false; // seen once, it does not come back with the next task
    remember();
  }

  function attach(view) {
    let pressed = null;
    const capture = { capture: true };
    view.addEventListener("pointerdown", (event) => (pressed = event), capture);
    view.addEventListener("wheel", () => check("turn"), capture);
    view.addEventListener("keydown", ({ code }) => CAMERA_KEYS.test(code) && check("turn"), capture);
    view.addEventListener(
      "pointerup",
      ({ clientX, clientY }) => {
        const way = pressed ? Math.hypot(clientX - pressed.clientX, clientY - pressed.clientY) : 0;
        if (way > TURNED && !page.registration()?.dragging) check("turn");
        pressed = null;
      },
      capture,
    );
  }

  return { open, draw, attach };
}

const isElsewhere = (now, before) => String(now.T_world_object) !== String(before.T_world_object);

function withKeys(text) {
  return text.split("`").map((part, index) => (index % 2 ? element("kbd", {}, part) : part));
}

function mark(isDone, isNext) {
  return element("li", { className: isDone ? "done" : isNext ? "next" : "" }, isDone ? "✓" : "");
}
