/** What comes after submitting: the next task. */

import { nextTask } from "../api.js";
import { byId, element, icon, setText } from "../dom.js";

/** Shows where `#next-task` leads; without another task it leads home. */
export async function showNext() {
  const task = await nextTask();
  const link = byId("next-task");
  link.href = task ? `/label/${task.id}` : "/";
  link.replaceChildren(task ? "Next task " : "Back to the tasks ", element("kbd", {}, "Enter"), icon("next"));
  const sentence = task ? `Next: ${task.object.name}, ${task.scene.label}.` : "That was the last one.";
  setText(byId("next-name"), sentence);
}
