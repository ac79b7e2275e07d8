/** Small and exact changes of the pose: nudges by key, quarter turns, flips, putting down; the gizmo's axes. */

import { byId, setText } from "../shared/dom.js";

/** Millimetres and degrees alike. */
const STEPS = [0.5, 2, 10];
const AXES = ["view", "object", "world"];
const RADIANS = Math.PI / 180;

const ALONG = { J: [-1, 0, 0], L: [1, 0, 0], K: [0, -1, 0], I: [0, 1, 0], U: [0, 0, -1], O: [0, 0, 1] };
/** x right, y down, z away; what is near turns to where the key points. */
const VIEW_MOVES = { ...ALONG, I: [0, -1, 0], K: [0, 1, 0] };
const VIEW_TURNS = { ...ALONG, J: [0, 1, 0], L: [0, -1, 0], I: [-1, 0, 0], K: [1, 0, 0] };
const LETTERS = ["J", "L", "I", "K", "U", "O"];

const LEGEND = {
  view: "J L left, right · I K up, down · U O nearer, farther. Shift turns that way, Alt by 90°.",
  object: "J L along x · I K along y · U O along z. Shift turns about it, Alt by 90°.",
};
const STORED = "snap6d.precision";

/**
 * A part of the labelling page.
 *
 * @param {LabelPage} page
 * @returns {Part}
 */
export function precisionPart(page) {
  const section = byId("precision");
  /** @returns {HTMLButtonElement[]} */
  const buttons = (name) => [.../** @type {NodeListOf<any>} */ (document.querySelectorAll(`[data-${name}]`))];
  const waiting = [];
  let sending = false;
  let { step, axes, open } = {
    step: 1,
    axes: "view",
    open: false,
    ...JSON.parse(localStorage[STORED] ?? "{}"),
  };

  section.open = open;
  section.addEventListener("toggle", () => {
    open = section.open;
    remember();
  });
  for (const button of buttons("step"))
    button.addEventListener("click", () => useStep(Number(button.dataset.step)));
  for (const button of buttons("axes")) button.addEventListener("click", () => useAxes(button.dataset.axes));
  for (const button of buttons("gizmo"))
    button.addEventListener("click", () => useGizmo(button.dataset.gizmo));
  for (const button of buttons("turn")) {
    const { turn, about } = button.dataset;
    button.addEventListener("click", () => rotate(ALONG[about ?? ""], Number(turn)));
  }
  byId("rest").addEventListener("click", rest);
  show();

  function remember() {
    localStorage[STORED] = JSON.stringify({ step, axes, open });
  }

  function useStep(index) {
    step = index;
    show();
    remember();
  }

  function useAxes(name) {
    axes = name;
    show();
    remember();
  }

  function show() {
    press(buttons("step"), (button) => Number(button.dataset.step) === step);
    press(buttons("axes"), (button) => button.dataset.axes === axes);
    setText(byId("nudge-legend"), LEGEND[axes] ?? LEGEND.object);
  }

  function draw({ gizmo_axes: gizmo }) {
    press(buttons("gizmo"), (button) => button.dataset.gizmo === gizmo);
    for (const button of [...buttons("gizmo"), ...buttons("turn"), byId("rest")])
      button.disabled = !page.canMove();
  }

  function move(letter) {
    const direction = (axes === "view" ? VIEW_MOVES : ALONG)[letter];
    nudge({ translation: scaled(direction, STEPS[step] / 1000), technique: "nudge" });
  }

  function turn(letter, degrees, technique) {
    const direction = (axes === "view" ? VIEW_TURNS : ALONG)[letter];
    nudge({ rotation: scaled(direction, degrees * RADIANS), technique });
  }

  function rotate(direction, degrees) {
    nudge({ rotation: scaled(direction, degrees * RADIANS), technique: degrees === 180 ? "flip" : "turn" });
  }

  /** One at a time, in order: a key held down must not overtake the answers. */
  async function nudge(change) {
    if (!page.canMove()) return;
    waiting.push({ axes, ...change });
    if (sending) return;
    sending = true;
    page.message.clear();
    try {
      while (waiting.length) await page.post("nudge", joined(waiting));
    } catch (error) {
      waiting.length = 0;
      page.message.problem(error);
    } finally {
      sending = false;
    }
  }

  async function rest() {
    if (!page.canMove()) return;
    page.message.clear();
    await page.post("rest").catch(page.message.problem);
  }

  async function useGizmo(name) {
    if (page.canMove()) await page.put("gizmo", { axes: name }).catch(page.message.problem);
  }

  const otherGizmo = () => (page.registration()?.gizmo_axes === "world" ? "object" : "world");
  const nextAxes = () => AXES[(AXES.indexOf(axes) + 1) % AXES.length];
  const lettersWith = (modifier) => LETTERS.map((letter) => modifier + letter);
  const letterOf = (chord) => chord.at(-1);

  const bindings = [
    {
      keys: LETTERS,
      does: "Move the object a step",
      run: (key) => move(letterOf(key)),
      repeats: true,
      tool: "precision",
    },
    {
      keys: lettersWith("Shift+"),
      caps: ["Shift", ...LETTERS],
      does: "Turn it a step",
      run: (key) => turn(letterOf(key), STEPS[step], "nudge"),
      tool: "precision",
      repeats: true,
    },
    {
      keys: lettersWith("Alt+"),
      caps: ["Alt", ...LETTERS],
      does: "Turn it by 90°",
      run: (key) => turn(letterOf(key), 90, "turn"),
      tool: "precision",
    },
    {
      keys: lettersWith("Alt+Shift+"),
      caps: ["Alt", "Shift", ...LETTERS],
      does: "Flip it",
      run: (key) => turn(letterOf(key), 180, "flip"),
      tool: "precision",
    },
    {
      keys: ["1", "2", "3"],
      does: "Steps: 0.5, 2, 10 mm and degrees",
      run: (key) => useStep(key - 1),
      tool: "precision",
    },
    {
      keys: ["X"],
      does: "Step along the view, the object, the world",
      run: () => useAxes(nextAxes()),
      tool: "precision",
    },
    { keys: ["G"], does: "Gizmo along the object, the world", run: () => useGizmo(otherGizmo()) },
    { keys: ["Shift+P"], does: "Put the object down on the surface", run: rest, tool: "precision" },
  ];
  return { title: "The object", bindings, draw };
}

function press(buttons, isPressed) {
  for (const button of buttons) button.setAttribute("aria-pressed", isPressed(button));
}

function scaled(vector, factor) {
  return vector.map((component) => component * factor);
}

/** Takes the first of the waiting changes, and what follows of the same kind, as one. */
function joined(waiting) {
  const first = waiting.shift();
  const kind = JSON.stringify(first);
  let count = 1;
  while (waiting.length && JSON.stringify(waiting[0]) === kind) count += waiting.splice(0, 1).length;
  const { translation = [0, 0, 0], rotation = [0, 0, 0] } = first;
  return { ...first, translation: scaled(translation, count), rotation: scaled(rotation, count) };
}
