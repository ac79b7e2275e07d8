/** The form for an axis by numbers, or by two points that are picked on the mesh. */

import { post } from "../shared/api.js";
import { byId, setText } from "../shared/dom.js";
import { foldText, HIGHEST_FOLD, normalized, residualText } from "./axes.js";

const DIGITS = 4; // of a direction and of millimetres

/** How far turns about an axis carry an object off itself, metres. */
export async function residualOf({ id }, { axis, point, fold }) {
  return (await post(`/api/objects/${id}/residual`, { axis, point, fold })).residual;
}

/**
 * `item()` is the object; `save(axes)` decides for all its axes and tells whether that was accepted; `onChange` is
 * called when what is to be drawn has changed; `play(button, axis)` plays an axis.
 */
export function axisEditor({ item, save, onChange, play, onProblem }) {
  const form = byId("editor");
  const fields = {
    axis: ["x", "y", "z"].map((k) => byId(`axis-${k}`)),
    point: ["x", "y", "z"].map((k) => byId(`point-${k}`)),
  };
  let changed = null; // the place of the axis that is changed; null: one is added
  let points = null; // picked so far; null: none are asked for

  byId("fold").append(new Option(foldText(null), ""));
  for (let fold = 2; fold <= HIGHEST_FOLD; fold++)
    byId("fold").append(new Option(foldText(fold), String(fold)));
  form.addEventListener("submit", submit);
  form.addEventListener("input", numbersChanged);
  byId("cancel").addEventListener("click", close);
  byId("pick").addEventListener("click", () => pick(points === null));
  byId("try").addEventListener("click", tryIt);

  /** For the axis at a place, or for one more. */
  function open(index = null) {
    changed = index;
    const { axes, centre } = item();
    fill(index === null ? { axis: [0, 0, 1], point: centre, fold: 2 } : axes[index]);
    setText(byId("editor-title"), index === null ? "Add an axis" : "Change an axis");
    setText(byId("save"), index === null ? "Add it" : "Save it");
    form.hidden = false;
    byId("add").setAttribute("aria-expanded", "true");
    pick(false);
    numbersChanged();
    form.scrollIntoView({ block: "nearest" });
    fields.axis[0].focus({ preventScroll: true });
  }

  function close() {
    form.hidden = true;
    byId("add").setAttribute("aria-expanded", "false");
    pick(false);
    play(null, null);
    onChange();
  }

  function fill({ axis, point, fold }) {
    for (const k of [0, 1, 2]) {
      fields.axis[k].value = rounded(axis[k]);
      fields.point[k].value = rounded(1000 * point[k]);
    }
    byId("fold").value = fold ?? "";
  }

  /** The axis of the numbers; null where they are none. */
  function draft() {
    if (form.hidden) return null;
    const read = (inputs, unit) => inputs.map((input) => input.valueAsNumber * unit);
    const [axis, point] = [read(fields.axis, 1), read(fields.point, 0.001)];
    if (![...axis, ...point].every(Number.isFinite)) return null;
    return normalized({ axis, point, fold: byId("fold").value ? Number(byId("fold").value) : null });
  }

  function numbersChanged() {
    setText(byId("misses"), "");
    play(null, null);
    onChange();
  }

  function pick(on) {
    points = on ? [] : null;
    byId("pick").setAttribute("aria-pressed", on);
    byId("mesh").classList.toggle("picking", on);
    tellNext();
    if (on) play(null, null);
  }

  function tellNext() {
    const next =
      points === null
        ? ""
        : `Click the ${points.length ? "second" : "first"} point of the axis on the object.`;
    setText(byId("pick-next"), next);
  }

  function onPoint(point) {
    if (points === null) return;
    points.push(point);
    if (points.length < 2) {
      tellNext();
      onChange();
      return;
    }
    const [first, second] = points;
    const through = normalized({ axis: second.map((value, k) => value - first[k]), point: first });
    pick(false);
    if (through === null) setText(byId("pick-next"), "That was one point twice: pick two that lie apart.");
    else fill({ ...through, fold: draft()?.fold ?? null });
    numbersChanged();
  }

  async function tryIt() {
    const axis = required();
    if (!axis) return;
    play(byId("try"), axis);
    setText(byId("misses"), "measuring…");
    try {
      const residual = await residualOf(item(), axis);
      setText(byId("misses"), residualText(residual, item().diameter));
    } catch (error) {
      setText(byId("misses"), "");
      onProblem(error);
    }
  }

  async function submit(event) {
    event.preventDefault();
    const axis = required();
    if (!axis) return;
    const { axes } = item();
    const all =
      changed === null ? [...axes, axis] : axes.map((one, index) => (index === changed ? axis : one));
    if (await save(all)) close();
  }

  function required() {
    const axis = draft();
    if (!axis) onProblem(new Error("The direction is none: give three numbers that are not all 0."));
    return axis;
  }

  return { open, draft, onPoint, picked: () => points ?? [] };
}

const rounded = (value) => Number(value.toFixed(DIGITS)) + 0;
