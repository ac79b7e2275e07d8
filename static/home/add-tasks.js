/** The "Add tasks" dialog: choose a scene, look at its picture, tick the objects that are in it. */

import { get, getAll, post } from "../shared/api.js";
import { byId, element, picture, setText } from "../shared/dom.js";
import { count, METHODS } from "../shared/format.js";
import { messageArea } from "../shared/message.js";

/**
 * `onAdded(number)` is called after tasks were made.
 *
 * @param {(added: number) => unknown} onAdded
 */
export function setUpAddTasks(onAdded) {
  const dialog = byId("add-tasks");
  const datasetSelect = byId("add-dataset");
  const sceneSelect = byId("add-scene");
  const list = byId("add-objects");
  const message = messageArea(byId("add-message"));
  /** @type {Rest["ObjectOut"][]} */
  let objects = [];

  byId("add-method").append(
    ...Object.entries(METHODS).map(([method, { choice }]) => new Option(choice, method)),
  );
  datasetSelect.addEventListener("change", () => guarded(() => showDataset()));
  sceneSelect.addEventListener("change", () => guarded(showScene));
  list.addEventListener("change", showChoice);
  byId("add-tasks-form").addEventListener("submit", (event) => {
    event.preventDefault();
    guarded(addTasks);
  });

  async function open({ dataset_id: datasetId, scene_id: sceneId }) {
    dialog.showModal();
    await guarded(async () => {
      const datasets = await getAll("/api/datasets");
      datasetSelect.replaceChildren(...datasets.map(({ name, id }) => new Option(name, String(id))));
      if (datasetId) datasetSelect.value = datasetId;
      await showDataset(sceneId);
    });
  }

  async function showDataset(sceneId = null) {
    const filter = { dataset_id: datasetSelect.value };
    const [scenes, all] = await Promise.all([getAll("/api/scenes", filter), getAll("/api/objects", filter)]);
    objects = all;
    sceneSelect.replaceChildren(...scenes.map(({ label, id }) => new Option(label, String(id))));
    if (sceneId !== null) sceneSelect.value = sceneId;
    await showScene();
  }

  async function showScene() {
    const sceneId = sceneSelect.value;
    const [scene, tasks] = await Promise.all([
      get(`/api/scenes/${sceneId}`),
      getAll("/api/tasks", { scene_id: sceneId }),
    ]);
    byId("add-picture").replaceChildren(picture(scene.frames[0]?.color_url, "add-picture-frame"));
    const taken = new Map();
    for (const { object } of tasks) taken.set(object.id, (taken.get(object.id) ?? 0) + 1);
    list.replaceChildren(...objects.map((object) => objectChoice(object, taken.get(object.id) ?? 0)));
    showChoice();
  }

  function chosenIds() {
    const ticked = new Set(
      [...list.querySelectorAll("input")].filter(({ checked }) => checked).map(({ value }) => value),
    );
    return objects.map(({ id }) => id).filter((id) => ticked.has(String(id)));
  }

  function showChoice() {
    const chosen = chosenIds().length;
    byId("add-start").disabled = chosen === 0;
    setText(byId("add-start"), chosen === 0 ? "Add tasks" : `Add ${count(chosen, "task")}`);
  }

  async function addTasks() {
    byId("add-start").disabled = true;
    const method = /** @type {keyof typeof METHODS} */ (byId("add-method").value);
    const common = { scene_id: Number(sceneSelect.value), method };
    const ids = chosenIds();
    try {
      for (const id of ids) await post("/api/tasks", { ...common, object_id: id });
    } catch (error) {
      await showScene(); // Shows which of them were made before the failure.
      throw error;
    }
    dialog.close();
    await onAdded(ids.length);
  }

  async function guarded(work) {
    message.clear();
    try {
      await work();
    } catch (error) {
      message.problem(error);
    }
  }

  return { open };
}

function objectChoice({ id, name, diameter }, taken) {
  const box = element("input", { type: "checkbox", value: id });
  const note = taken ? `has ${count(taken, "task")}` : `${Math.round(diameter * 1000)} mm`;
  return element("label", {}, box, element("span", {}, name), element("small", {}, note));
}
