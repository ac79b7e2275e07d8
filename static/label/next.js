/** What comes after a task: the next one of those that its operator works on. */

import { nextTask } from "../shared/api.js";
import { byId, element, icon, setText } from "../shared/dom.js";
import { addressWith, filterIn, isNarrow } from "../shared/task-filter.js";

let shown = Promise.resolve();

/** Goes where `#next-task` leads, as soon as that is known. */
export async function goToNext() {
  await shown;
  location.assign(byId("next-task").href);
}

/**
 * Shows where `#next-task` leads: to another task of the dataset, and of what was chosen on the home page; without
 * one it leads home.
 *
 * @param {Rest["TaskOut"]} task
 */
export function showNext({ dataset }) {
  shown = show(dataset);
  return shown;
}

async function show(dataset) {
  const filter = filterIn(location.search);
  const task = await nextTask({ ...filter, dataset_id: filter.dataset_id ?? dataset.id });
  const link = byId("next-task");
  link.href = addressWith(task ? `/label/${task.id}` : "/", filter);
  link.replaceChildren(task ? "Next task " : "Back to the tasks ", element("kbd", {}, "Enter"), icon("next"));
  const sentence = task
    ? `Next: ${task.name}, ${task.scene.label}.`
    : `That was the last one of ${isNarrow(filter) ? "those you chose" : dataset.name}.`;
  setText(byId("next-name"), sentence);
}
