/** Setting a study up: a form, and beside it the order that it leads to. */

import { get, getAll, post } from "../api.js";
import { byId, element, picture, setText } from "../dom.js";
import { count, taskName } from "../format.js";
import { messageArea } from "../message.js";
import { showOrders } from "./orders.js";

const PAUSE_MS = 250; // after the last key, before the order is asked for

export async function showSetUp(pageMessage) {
  const message = messageArea(byId("preview-message"));
  const things = new Map(); // {ref, name, scene, url, use} of all datasets looked at; `use`: "", "task", "practice"
  let waiting = null;
  let newest = 0;

  const modes = await fillFromDescription();
  byId("seed").value = crypto.getRandomValues(new Uint32Array(1))[0] % 100000;
  const datasets = await getAll("/api/datasets");
  byId("dataset").replaceChildren(...datasets.map(({ id, name }) => new Option(name, id)));
  byId("dataset").addEventListener("change", () => showThings().catch(pageMessage.problem));
  byId("set-up").addEventListener("input", later);
  byId("set-up").addEventListener("submit", create);
  setText(byId("crumb-study"), "New study");
  byId("crumb-study").hidden = false;
  byId("set-up").hidden = false;
  if (datasets.length) await showThings();

  async function showThings() {
    const tasks = await getAll("/api/tasks", { dataset_id: byId("dataset").value });
    const keys = new Set(); // of tasks for one thing, in several modes and conditions, one stands for all
    for (const thing of tasks.map(thingOf)) {
      const key = keyOf(thing.ref);
      keys.add(key);
      if (!things.has(key)) things.set(key, thing);
    }
    byId("things").replaceChildren(...[...keys].map((key) => thingRow(things.get(key))));
    later();
  }

  function thingRow(thing) {
    const choice = element(
      "select",
      { "aria-label": `${thing.name}, ${thing.scene}` },
      new Option("not used", ""),
      new Option("counts", "task"),
      new Option("for practice", "practice"),
    );
    choice.value = thing.use;
    choice.addEventListener("change", () => (thing.use = choice.value));
    const text = element("span", {}, thing.name, element("small", {}, thing.scene));
    return element("div", { className: "thing" }, picture(thing.url, "thing-picture", { lazy: true }), text, choice);
  }

  function plan() {
    const used = (use) => [...things.values()].filter((thing) => thing.use === use).map(({ ref }) => ref);
    return {
      modes: ticked("modes"),
      conditions: ticked("conditions"),
      groups: Object.fromEntries(groupsOf(byId("groups").value)),
      tasks: used("task"),
      practice: used("practice"),
      consent: byId("consent").value,
      instructions: Object.fromEntries(modes.map((mode) => [mode, byId(`instructions-${mode}`).value])),
      questions: questionsOf(byId("questions").value),
      break_after: Number(byId("break-after").value),
    };
  }

  function later() {
    const mine = ++newest;
    const isNewest = () => mine === newest;
    clearTimeout(waiting);
    byId("create").disabled = true;
    waiting = setTimeout(() => preview(isNewest).catch((error) => isNewest() && message.problem(error)), PAUSE_MS);
  }

  /** Of several answers only the one to the form as it is now counts. */
  async function preview(isNewest) {
    message.clear();
    byId("preview-orders").replaceChildren();
    const wanted = plan();
    const lacks = missing(wanted, groupsOf(byId("groups").value));
    setText(byId("preview-summary"), lacks ?? "");
    if (lacks) return;
    const answer = await post("/api/studies/preview", { plan: wanted, seed: Number(byId("seed").value) });
    if (!isNewest()) return;
    setText(byId("preview-summary"), summary(wanted, answer));
    byId("preview-orders").replaceChildren(showOrders(answer.orders, nameOf));
    byId("create").disabled = false;
  }

  function nameOf(ref) {
    const { name, scene } = things.get(keyOf(ref));
    return `${name}, ${scene}`;
  }

  async function create(event) {
    event.preventDefault();
    byId("create").disabled = true;
    try {
      const body = { name: byId("name").value, plan: plan(), seed: Number(byId("seed").value) };
      const { id } = await post("/api/studies", body);
      location.assign(`/studies?study=${id}`);
    } catch (error) {
      message.problem(error);
      byId("create").disabled = false;
    }
  }
}

/** What there is to choose, and what a plan is where nothing is chosen, the server says; returns the modes. */
async function fillFromDescription() {
  const { components } = await get("/api/openapi.json");
  const plan = components.schemas.StudyPlan.properties;
  for (const name of ["modes", "conditions"]) {
    const { items, default: first } = plan[name];
    byId(name).replaceChildren(...items.enum.map((value) => tick(name, value, first.includes(value))));
  }
  const modes = plan.modes.items.enum;
  for (const mode of modes) byId(`instructions-${mode}`).value = plan.instructions.default[mode];
  byId("groups").value = Object.entries(plan.groups.default).map((group) => group.join(" ")).join(", ");
  byId("break-after").value = plan.break_after.default;
  return modes;
}

function thingOf(task) {
  const ref = { scene_id: task.scene.id, object_id: task.object.id, instance: task.instance };
  return { ref, name: taskName(task), scene: task.scene.label, url: task.thumbnail_url, use: "" };
}

const keyOf = ({ scene_id: scene, object_id: object, instance }) => `${scene} ${object} ${instance}`;

function tick(group, name, checked) {
  const box = element("input", { type: "checkbox", name: group, value: name, checked });
  return element("label", {}, box, name);
}

function ticked(group) {
  return [...document.querySelectorAll(`[name="${group}"]:checked`)].map(({ value }) => value);
}

/** "novice 8, expert 8" as [["novice", 8], ["expert", 8]]. */
function groupsOf(text) {
  const parts = text.split(",").map((part) => part.trim()).filter(Boolean);
  return parts.map((part) => {
    const [, name, size] = part.match(/^(.*?)\s*(\d+)$/) ?? [null, part, "0"];
    return [name, Number(size)];
  });
}

/** "Handedness: left, right" as {text: "Handedness", choices: ["left", "right"]}, a line each. */
function questionsOf(text) {
  const lines = text.split("\n").map((line) => line.trim()).filter(Boolean);
  return lines.map((line) => {
    const [question, choices = ""] = line.split(/:(.*)/s);
    return { text: question.trim(), choices: choices.split(",").map((choice) => choice.trim()).filter(Boolean) };
  });
}

/** What the form still lacks, or null. */
function missing({ modes, conditions, tasks }, groups) {
  if (!tasks.length) return "Choose at least one thing that counts: then the order is shown here.";
  if (!modes.length || !conditions.length) return "Tick at least one mode and one condition.";
  if (!groups.length || groups.some(([name, size]) => !name || size < 1)) {
    return "Write each group with its number of operators, such as “novice 8, expert 8”.";
  }
  const names = groups.map(([name]) => name);
  const twice = names.find((name, index) => names.indexOf(name) < index);
  if (twice) return `The group “${twice}” is there twice: write each once.`;
  return null;
}

function summary({ groups, practice, conditions, tasks, modes }, { rows_of_balance: rows, orders }) {
  const each = tasks.length * modes.length * conditions.length;
  const trying = practice.length * conditions.length;
  const uneven = Object.entries(groups).filter(([, size]) => size % rows).map(([name]) => name);
  const trials = trying ? `${count(trying, "task")} for practice, then ${each} that count` : count(each, "task");
  const balance = uneven.length
    ? `For an even balance groups need a multiple of ${rows} operators; that is not so for ${uneven.join(", ")}.`
    : "The order is balanced evenly.";
  const isCut = Math.max(...Object.values(groups)) > orders.length;
  const shown = isCut ? ` Shown are the first ${orders.length}; the others follow in the same way.` : "";
  return `Each operator does ${trials}. Operator 1 is the first one of each group, and so on.${shown} ${balance}`;
}
