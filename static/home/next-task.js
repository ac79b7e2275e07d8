/** "My next task": the one big button. */

import { nextTask } from "../shared/api.js";
import { byId, element, icon, picture } from "../shared/dom.js";
import { addressWith } from "../shared/task-filter.js";

/**
 * Shows the next task of a dataset, or of all; without one, says so. Hidden while there are no tasks at all.
 *
 * @param {Rest["DatasetOut"][]} datasets
 * @param {string | number | null} datasetId
 */
export async function showNextTask(datasets, datasetId) {
  const anyTasks = datasets.some((dataset) => dataset.tasks > 0);
  byId("next").hidden = !anyTasks;
  if (!anyTasks) return;
  const filter = { dataset_id: datasetId };
  const task = await nextTask(filter);
  const dataset = datasets.find(({ id }) => String(id) === String(datasetId));
  byId("next-body").replaceChildren(...(task ? describeTask(task, filter) : describeDone(dataset)));
}

function describeTask(task, filter) {
  const verb = task.mine === null ? "Start" : "Continue";
  const start = element("a", {
    id: "next-task",
    className: "button human big",
    href: addressWith(`/label/${task.id}`, filter),
  });
  start.append(`${verb} labelling`, icon("next"));
  return [
    picture(task.thumbnail_url, "next-picture"),
    element(
      "p",
      {},
      element("span", { className: "next-name" }, task.name),
      element("br"),
      element("span", { className: "muted" }, `${task.scene.label} · ${task.dataset.name}`),
    ),
    start,
  ];
}

function describeDone(dataset) {
  return [
    element(
      "p",
      { className: "next-name" },
      icon("check"),
      dataset ? ` All of ${dataset.name} done` : " All done",
    ),
    element("p", { className: "muted" }, "No task is waiting for you here. You can look at any in the list."),
  ];
}
