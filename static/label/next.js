/** What comes after a task: the next one. */

import { nextTask } from "../api.js";
import { byId, element, icon, setText } from "../dom.js";
import { taskName } from "../format.js";

let shown = Promise.resolve();

/** Goes where `#next-task` leads, as soon as that is known. */
export async function goToNext() {
  await shown;
  location.assign(byId("next-task").href);
}

/** Shows where `#next-task` leads; without another task it leads home. */
export function showNext() {
  shown = show();
  return shown;
}

async function show() {
  const task = await nextTask();
  const link = byId("next-task");
  link.href = task ? `/label/${task.id}` : "/";
  link.replaceChildren(task ? "Next task " : "Back to the tasks ", element("kbd", {}, "Enter"), icon("next"));
  const sentence = task ? `Next: ${taskName(task)}, ${task.scene.label}.` : "That was the last one.";
  setText(byId("next-name"), sentence);
}
