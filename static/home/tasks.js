/** The tasks as cards, filtered by dataset, scene and state. The filter is kept in the page's address. */

import { get, getAll } from "../api.js";
import { verdictMark } from "../assessment.js";
import { byId, element, icon, picture, setText } from "../dom.js";
import { count, METHODS, taskName } from "../format.js";

const PAGE = 48;
const STATES = { open: "Open", in_progress: "In progress", submitted: "Submitted", skipped: "Skipped" };

/** `openAddTasks` is null for those who may not add tasks; `onProblem(error)` shows what went wrong. */
export function setUpTasks({ me, openAddTasks, onProblem }) {
  const given = new URLSearchParams(location.search);
  const names = ["dataset_id", "scene_id", "state"];
  const filter = Object.fromEntries(names.map((name) => [name, given.get(name)]));
  let datasets = [];
  let next = null;
  let request = 0;

  byId("scene-filter").addEventListener("change", (event) => change("scene_id", event.target.value));
  byId("state-filter").addEventListener("change", (event) => change("state", event.target.value));
  byId("more").addEventListener("click", () => showMore().catch(onProblem));
  for (const radio of document.querySelectorAll("#state-filter input")) {
    radio.checked = radio.value === (filter.state ?? "");
  }

  function change(name, value) {
    filter[name] = value || null;
    return show().catch(onProblem);
  }

  async function chooseDataset(id) {
    if (String(id) !== String(filter.dataset_id)) filter.scene_id = null;
    filter.dataset_id = id;
    await Promise.all([show(), showScenes()]);
  }

  async function show() {
    const address = new URLSearchParams(Object.entries(filter).filter(([, value]) => value !== null));
    history.replaceState(null, "", address.size ? `?${address}` : location.pathname);
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
    byId("tasks").append(...items.map((task) => element("li", {}, taskCard(task, me), cardLinks(task, me))));
    byId("more").hidden = next === null;
    setText(byId("tasks-status"), `${count(byId("tasks").childElementCount, "task")} shown`);
  }

  async function showScenes() {
    const select = byId("scene-filter");
    const datasetId = filter.dataset_id ?? (datasets.length === 1 ? datasets[0].id : null);
    const scenes = datasetId === null ? [] : await getAll("/api/scenes", { dataset_id: datasetId });
    const options = scenes.map((scene) => new Option(scene.label, scene.id));
    select.replaceChildren(new Option("All scenes", ""), ...options);
    select.value = filter.scene_id ?? "";
    select.disabled = scenes.length === 0;
    select.title = datasetId === null ? "Choose a dataset first" : "";
  }

  function describeNone() {
    const title = element("h2", {}, "No tasks here");
    if (filter.state || filter.scene_id) {
      const clear = element("button", { type: "button", className: "button" }, "Show all tasks");
      clear.addEventListener("click", () => {
        filter.scene_id = filter.state = null;
        byId("scene-filter").value = "";
        document.querySelector("#state-filter input").checked = true;
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

  const setDatasets = (all) => {
    datasets = all;
  };
  return { filter, chooseDataset, setDatasets };
}

function taskCard(task, me) {
  const card = element("a", {
    className: "card",
    href: `/label/${task.id}`,
    "data-task-id": task.id,
    "data-state": task.state,
  });
  card.append(
    picture(task.thumbnail_url, "card-picture", { lazy: true }),
    element(
      "span",
      { className: "card-text" },
      element("span", { className: "card-name" }, taskName(task)),
      element("span", { className: "card-scene" }, sceneText(task)),
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
  const page = element("a", { href: `/objects/${object.id}`, "aria-label": `Object ${object.name}` }, "Object");
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

/** "In progress · you, Ada", "Skipped · you (no depth)". */
function stateSentence(task, me) {
  const names = task.operators.map(({ name, skip_reason: reason }) => {
    const who = name === me.name ? "you" : name;
    return reason ? `${who} (${reason})` : who;
  });
  return names.length ? `${STATES[task.state]} · ${names.join(", ")}` : STATES[task.state];
}
