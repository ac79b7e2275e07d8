/** The tasks as cards, filtered by dataset, scene, state, mode and condition. The filter is kept in the page's address. */

import { get, getAll } from "../shared/api.js";
import { verdictMark } from "../shared/assessment.js";
import { byId, element, icon, picture, setText } from "../shared/dom.js";
import { count, METHODS } from "../shared/format.js";
import { addressWith, CHOICES, filterIn, isNarrow } from "../shared/task-filter.js";
import { keepPlace } from "./place.js";

const PAGE = 48;
const STATES = { open: "Open", in_progress: "In progress", submitted: "Submitted", skipped: "Skipped" };

/** What tasks may differ in, which is shown where they do. */
const KINDS = ["mode", "condition"];

/** `openAddTasks` is null for those who may not add tasks; `onProblem(error)` shows what went wrong. */
export function setUpTasks({ me, openAddTasks, onProblem }) {
  const filter = filterIn(location.search);
  /** @type {Rest["DatasetOut"][]} */
  let datasets = [];
  let next = null;
  let request = 0;
  keepPlace(() => ({ shown: byId("tasks").childElementCount }));

  byId("scene-filter").addEventListener("change", () => change("scene_id", byId("scene-filter").value));
  for (const kind of KINDS) {
    const select = byId(`${kind}-filter`);
    select.addEventListener("change", () => change(kind, select.value));
  }
  byId("more").addEventListener("click", () => showMore().catch(onProblem));
  for (const radio of byId("state-filter").querySelectorAll("input")) {
    radio.checked = radio.value === (filter.state ?? "");
    radio.addEventListener("change", () => change("state", radio.value));
  }

  function change(name, value) {
    filter[name] = value || null;
    return show().catch(onProblem);
  }

  async function chooseDataset(id) {
    if (String(id) !== String(filter.dataset_id)) filter.scene_id = null;
    filter.dataset_id = id;
    showKinds();
    await Promise.all([show(), showScenes()]);
  }

  async function show() {
    history.replaceState(null, "", addressWith(location.pathname, filter));
    const mine = ++request;
    const page = await get("/api/tasks", { ...filter, limit: PAGE });
    if (mine !== request) return; // A newer choice was made meanwhile.
    byId("tasks").replaceChildren();
    append(page);
    byId("no-tasks").hidden = page.items.length > 0;
    if (page.items.length === 0) byId("no-tasks").replaceChildren(...describeNone());
  }

  async function showMore() {
    const mine = request;
    const page = await get("/api/tasks", { ...filter, limit: PAGE, after: next });
    if (mine === request) append(page);
  }

  function append({ items, next: cursor }) {
    next = cursor ?? null;
    byId("tasks").append(
      ...items.map((task) => element("li", {}, taskCard(task, me, filter), cardLinks(task, me))),
    );
    for (const kind of KINDS) {
      const nodes = [...document.querySelectorAll(`#tasks [data-kind="${kind}"]`)];
      const isSame = new Set(nodes.map((node) => node.textContent)).size < 2;
      for (const node of nodes) node.hidden = isSame;
    }
    byId("more").hidden = next === null;
    setText(byId("tasks-status"), `${count(byId("tasks").childElementCount, "task")} shown`);
  }

  async function showScenes() {
    const select = byId("scene-filter");
    const datasetId = filter.dataset_id ?? (datasets.length === 1 ? datasets[0].id : null);
    const scenes = datasetId === null ? [] : await getAll("/api/scenes", { dataset_id: datasetId });
    const options = scenes.map((scene) => new Option(scene.label, String(scene.id)));
    select.replaceChildren(new Option("All scenes", ""), ...options);
    select.value = filter.scene_id ?? "";
    select.disabled = scenes.length === 0;
    select.title = datasetId === null ? "Choose a dataset first" : "";
  }

  /** A choice of modes or conditions is there where there are several. */
  function showKinds() {
    const chosen = datasets.filter(
      ({ id }) => filter.dataset_id === null || String(id) === String(filter.dataset_id),
    );
    for (const kind of KINDS) {
      const select = byId(`${kind}-filter`);
      const there = new Set(chosen.flatMap((dataset) => dataset[`${kind}s`]));
      if (filter[kind]) there.add(filter[kind]);
      select.replaceChildren(
        new Option(`All ${kind}s`, ""),
        ...[...there].sort().map((name) => new Option(name, name)),
      );
      select.value = filter[kind] ?? "";
      select.parentElement.hidden = there.size < 2 && !filter[kind];
    }
  }

  function describeNone() {
    const title = element("h2", {}, "No tasks here");
    if (isNarrow(filter)) {
      const clear = element("button", { type: "button", className: "button" }, "Show all tasks");
      clear.addEventListener("click", () => {
        for (const name of CHOICES) filter[name] = null;
        byId("scene-filter").value = "";
        showKinds();
        byId("state-filter").querySelectorAll("input")[0].checked = true;
        show().catch(onProblem);
      });
      return [title, element("p", {}, "No task matches what you chose above."), clear];
    }
    if (datasets.length === 0) return [title, element("p", {}, "Tasks appear once a dataset is imported.")];
    if (!openAddTasks) return [title, element("p", {}, "An administrator has to add tasks first.")];
    return [
      title,
      element("p", {}, "A task is one object to align in one scene. Choose a scene and the objects in it."),
      element("button", { type: "button", className: "button human", onclick: openAddTasks }, "Add tasks"),
    ];
  }

  /** Shows as many tasks as were shown when the page was left, from where they were seen. */
  async function goBackTo({ shown, top }) {
    while (next !== null && byId("tasks").childElementCount < shown) await showMore();
    scrollTo(0, top);
  }

  const setDatasets = (all) => {
    datasets = all;
  };
  return { filter, chooseDataset, setDatasets, goBackTo };
}

function taskCard(task, me, filter) {
  const card = element("a", {
    className: "card",
    href: addressWith(`/label/${task.id}`, filter),
    "data-task-id": task.id,
    "data-state": task.state,
  });
  card.append(
    picture(task.thumbnail_url, "card-picture", { lazy: true }),
    element(
      "span",
      { className: "card-text" },
      element("span", { className: "card-name" }, task.name),
      element("span", { className: "card-scene" }, sceneText(task)),
      element(
        "span",
        { className: "card-kinds" },
        ...KINDS.map((kind) => element("span", { "data-kind": kind }, task[kind])),
      ),
      element("span", { className: "card-state" }, icon(task.state), stateSentence(task, me)),
    ),
  );
  return card;
}

/** "scene 3", "scene 3 · paper’s filter". */
function sceneText({ scene, method }) {
  return method === "default" ? scene.label : `${scene.label} · ${METHODS[method].name}`;
}

/**
 * The object's page; and who submitted the task, each name leading to the replay: one's own, or all for a
 * reviewer, who also sees what is to be thought of the machine's last estimate.
 */
function cardLinks({ operators, object }, me) {
  const page = element(
    "a",
    { href: `/objects/${object.id}`, "aria-label": `Object ${object.name}` },
    "Object",
  );
  const links = operators
    .filter(({ name, state }) => state === "submitted" && (name === me.name || me.role !== "operator"))
    .flatMap(({ name, registration_id: id, assessment }) => {
      const shown = name === me.name ? "you" : name;
      const link = element("a", { href: `/replay/${id}`, "aria-label": `Replay of ${shown}` }, shown);
      return assessment ? [link, verdictMark(assessment)] : [link];
    });
  const replays = links.length ? [icon("play"), "Replay", ...links] : [];
  return element("p", { className: "card-links" }, icon("cube"), page, ...replays);
}

/** "In progress · you, Ada (open now)", "Skipped · you (no depth)". */
function stateSentence(task, me) {
  const names = task.operators.map(({ name, skip_reason: reason, is_here: isHere }) => {
    const who = name === me.name ? "you" : name;
    const more = [reason, isHere ? "open now" : null].filter(Boolean);
    return more.length ? `${who} (${more.join(", ")})` : who;
  });
  return names.length ? `${STATES[task.state]} · ${names.join(", ")}` : STATES[task.state];
}
