/** "My next task": the one big button. */

import { nextTask } from "../api.js";
import { byId, element, icon, picture } from "../dom.js";
import { taskName } from "../format.js";

/** Shows the next task; without one, says that all is done. Hidden while there are no tasks at all. */
export async function showNextTask(datasets) {
  const anyTasks = datasets.some((dataset) => dataset.tasks > 0);
  byId("next").hidden = !anyTasks;
  if (!anyTasks) return;
  const task = await nextTask();
  byId("next-body").replaceChildren(...(task ? describeTask(task) : describeDone()));
}

function describeTask(task) {
  const verb = task.mine === null ? "Start" : "Continue";
  const start = element("a", { id: "next-task", className: "button human big", href: `/label/${task.id}` });
  start.append(`${verb} labelling`, icon("next"));
  return [
    picture(task.thumbnail_url, "next-picture"),
    element(
      "p",
      {},
      element("span", { className: "next-name" }, taskName(task)),
      element("br"),
      element("span", { className: "muted" }, `${task.scene.label} · ${task.dataset.name}`),
    ),
    start,
  ];
}

function describeDone() {
  return [
    element("p", { className: "next-name" }, icon("check"), " All done"),
    element("p", { className: "muted" }, "No task is waiting for you. You can look at any in the list."),
  ];
}
