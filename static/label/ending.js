/** The end of a task: skipping it with a reason, what comes next, and going back to it. */

import { byId, setText } from "../shared/dom.js";
import { showNext } from "./next.js";
import { possible } from "./panel.js";

/**
 * A part of the labelling page.
 *
 * @param {LabelPage} page
 * @returns {Part}
 */
export function endingPart(page) {
  const dialog = byId("skip-dialog");
  /** @type {Rest["TaskOut"]} */
  let task;
  const reasons = [...dialog.querySelectorAll("[data-reason]")];

  byId("skip").addEventListener("click", ask);
  dialog.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const chosen = reasons[Number(event.key) - 1];
    if (!chosen) return;
    event.preventDefault();
    chosen.click();
  });
  for (const button of reasons) button.addEventListener("click", () => skip(button.dataset.reason));

  function ask() {
    if (possible(page.registration(), page.isConnected()).skip) dialog.showModal();
  }

  async function skip(reason) {
    dialog.close();
    page.message.clear();
    await page.post("skip", { reason }).catch(page.message.problem);
  }

  function draw({ state, skip_reason: reason }, before) {
    if (state === "open") return;
    setText(byId("ended-text"), state === "skipped" ? `Skipped: ${reason}.` : "Submitted.");
    byId("ended-icon").setAttribute("href", `/static/icons.svg#${state}`);
    if (before?.state === state || page.isTrial()) return;
    dialog.close();
    page.message.clear();
    byId("replay").href = `/replay/${page.registration().id}`;
    showNext(task).catch(page.message.problem);
  }

  const bindings = [
    { keys: ["Shift+Enter"], does: "Skip the task, with a reason (1 to 4)", run: ask, tool: "ending" },
  ];
  return { title: "The task", bindings, open: (opened) => (task = opened), draw };
}
