/** Finding the object without a start: the machine looks where in the frame it may be. */

import { del, post } from "../shared/api.js";
import { byId } from "../shared/dom.js";
import { possible } from "./panel.js";

/**
 * A part of the labelling page; what is found is shown by `candidates.js`.
 *
 * @param {LabelPage} page
 * @returns {Part}
 */
export function findPart(page) {
  let asking = false;
  byId("find").addEventListener("click", find);
  byId("find-cancel").addEventListener("click", leave);

  const isLooking = () => ["queued", "running"].includes(page.registration()?.search?.state ?? "");
  const canFind = () => possible(page.registration(), page.isConnected()).find && !asking && !isLooking();

  async function find() {
    if (!canFind()) return;
    asking = true;
    page.message.clear();
    await post(page.path("searches"), {}).catch(page.message.problem);
    asking = false;
  }

  /** True if there was a search to cancel. */
  function leave() {
    if (!isLooking()) return false;
    del(`/api/searches/${page.registration().search?.id}`).catch(page.message.problem);
    return true;
  }

  function draw(registration, before) {
    const { search } = registration;
    byId("find-looking").hidden = !isLooking();
    const failed = search?.state === "failed" && before?.search?.state !== "failed";
    if (failed) page.message.show(search.message, "problem", { label: "Try again", run: find });
  }

  const bindings = [
    { keys: ["F"], does: "Find: the machine shows where the object may be", run: find, tool: "find it" },
  ];
  return { title: "The machine", bindings, draw, leave };
}
