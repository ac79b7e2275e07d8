/**
 * A task of a study: how far its participant is, a clock where the mode asks for one, and the way on.
 * What is for ordinary work alone is marked `data-ordinary`, what is for trials alone `data-trial`.
 */

import { get } from "../shared/api.js";
import { byId, setText } from "../shared/dom.js";

const SECOND_MS = 1000;

/**
 * A part of the labelling page.
 *
 * @param {LabelPage} page
 * @returns {Part}
 */
export function trialPart(page) {
  let clockKey = null; // under which the time used is kept
  let viewIsThere = false;

  function open(task) {
    if (!page.isTrial()) return;
    for (const node of document.querySelectorAll("[data-ordinary]")) node.hidden = true;
    for (const node of document.querySelectorAll("[data-trial]")) node.hidden = false;
    byId("trial").dataset.mode = task.mode;
    setText(byId("trial-mode"), task.mode === "quick" ? "As quickly as you can" : "As accurately as you can");
    if (task.mode === "quick") clockKey = `snap6d.clock.${page.me().id}.${task.id}`;
    startClock();
    showPlace().catch(page.message.problem);
  }

  async function showPlace() {
    const { done, total, task: next } = await get("/api/participation");
    setText(
      byId("trial-place"),
      next?.is_practice ? "Practice" : `Task ${Math.min(done + 1, total)} of ${total}`,
    );
  }

  /** Counts from when the scene is there; who comes back later goes on with what they had used. */
  function startClock() {
    if (clockKey === null || !viewIsThere || !byId("clock").hidden) return;
    byId("clock").hidden = false;
    showClock();
    setInterval(() => {
      if (page.registration()?.state !== "open") return;
      localStorage.setItem(clockKey, String(used() + 1));
      showClock();
    }, SECOND_MS);
  }

  const used = () => Number(localStorage.getItem(clockKey) ?? 0);

  function showClock() {
    const seconds = used();
    setText(byId("clock-text"), `${Math.floor(seconds / 60)}:${String(seconds % 60).padStart(2, "0")}`);
  }

  function attach() {
    viewIsThere = true;
    startClock();
  }

  function draw({ state }, before) {
    if (!page.isTrial() || state === "open" || before?.state === state) return;
    if (clockKey) localStorage.removeItem(clockKey);
    location.assign("/participate?go-on");
  }

  return { open, attach, draw };
}
