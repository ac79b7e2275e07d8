/** Objects in scenes, to choose from for a study: found by name, used one by one or all that are shown. */

import { byId, element, picture, setText } from "../shared/dom.js";
import { count } from "../shared/format.js";

const FOUND = "Nothing is called so: change or empty the two searches.";
const NO_TASKS = "This dataset has no tasks yet: add some on the home page first.";

/**
 * Fills the list's place; calls `onChange()` whenever something else is used.
 *
 * @param {() => void} onChange
 */
export function thingList(onChange) {
  const things = new Map(); // {ref, name, scene, url, use, row} of all datasets looked at; `use`: "", "task", "practice"
  let here = []; // of the dataset that is shown

  for (const id of ["find-scene", "find-object"]) {
    byId(id).addEventListener("input", filter);
    byId(id).addEventListener("keydown", (event) => event.key === "Enter" && event.preventDefault()); // sets nothing up
  }
  byId("all-shown").addEventListener("click", () => useShown("task"));
  byId("none-shown").addEventListener("click", () => useShown(""));

  /** Shows what tasks are for; for one thing in several modes and conditions, one stands for all. */
  function show(tasks) {
    const keys = new Set();
    for (const thing of tasks.map(thingOf)) {
      const key = keyOf(thing.ref);
      keys.add(key);
      if (!things.has(key))
        things.set(key, { ...thing, row: rowOf(thing, (use) => change(things.get(key), use)) });
    }
    here = [...keys].map((key) => things.get(key));
    byId("thing-rows").replaceChildren(...here.map(({ row }) => row));
    filter();
  }

  function filter() {
    const [scene, object] = ["find-scene", "find-object"].map((id) => byId(id).value.trim().toLowerCase());
    for (const { row, name, scene: place } of here) {
      row.hidden = !name.toLowerCase().includes(object) || !place.toLowerCase().includes(scene);
    }
    tell();
  }

  function useShown(use) {
    for (const thing of shown()) {
      thing.use = use;
      thing.row.querySelector("select").value = use;
    }
    tell();
    onChange();
  }

  function change(thing, use) {
    thing.use = use;
    tell();
    onChange();
  }

  function tell() {
    const seen = shown().length;
    const chosen = `${used("task").length} count, ${used("practice").length} for practice`;
    setText(byId("things-told"), `${seen} of ${count(here.length, "object")} shown · ${chosen}`);
    setText(byId("no-things"), here.length ? FOUND : NO_TASKS);
    byId("no-things").hidden = seen > 0;
    for (const id of ["all-shown", "none-shown"]) byId(id).disabled = seen === 0;
  }

  const shown = () => here.filter(({ row }) => !row.hidden);
  const used = (use) => [...things.values()].filter((thing) => thing.use === use).map(({ ref }) => ref);

  function nameOf(ref) {
    const { name, scene } = things.get(keyOf(ref));
    return `${name}, ${scene}`;
  }

  return { show, used, nameOf };
}

function rowOf({ name, scene, url }, onUse) {
  const uses = [
    ["not used", ""],
    ["counts", "task"],
    ["for practice", "practice"],
  ];
  const choice = element(
    "select",
    { "aria-label": `${name}, ${scene}` },
    ...uses.map(([text, use]) => new Option(text, use)),
  );
  choice.addEventListener("change", () => onUse(choice.value));
  const text = element("span", {}, name, element("small", {}, scene));
  return element("div", { className: "thing" }, picture(url, "thing-picture", { lazy: true }), text, choice);
}

function thingOf(task) {
  const ref = { scene_id: task.scene.id, object_id: task.object.id, instance: task.instance };
  return { ref, name: task.name, scene: task.scene.label, url: task.thumbnail_url, use: "" };
}

const keyOf = ({ scene_id: scene, object_id: object, instance }) => `${scene} ${object} ${instance}`;
