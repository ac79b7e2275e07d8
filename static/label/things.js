/** What else is in the scene: a list that leads to it, and whether the 3-D view shows what is done. */

import { get, put } from "../shared/api.js";
import { byId, element, icon, setText } from "../shared/dom.js";

const HIDDEN = "snap6d.things.hidden";
const OPENED = "snap6d.things.open";

/**
 * A part of the labelling page.
 *
 * @param {LabelPage} page
 * @returns {Part}
 */
export function thingsPart(page) {
  const box = byId("things");
  const button = byId("hide-things");
  box.open = localStorage.getItem(OPENED) === "yes";
  box.addEventListener("toggle", () => localStorage.setItem(OPENED, box.open ? "yes" : "no"));
  button.addEventListener("click", toggle);
  window.addEventListener("focus", () => page.registration() && refresh());

  const isHidden = () => localStorage.getItem(HIDDEN) === "yes";

  function draw({ state }, before) {
    if (!before && isHidden()) tell().catch(page.message.problem);
    if (before?.state !== state) refresh();
  }

  async function refresh() {
    try {
      list((await get(page.path("things"))).items);
    } catch {
      // The stream tells of a lost connection; the list is read anew when it is back.
    }
  }

  function list(things) {
    const others = things.filter((thing) => !thing.is_current);
    const done = others.filter(({ T_world_object: pose }) => pose).length;
    box.hidden = others.length === 0;
    setText(byId("things-done"), `${done} of ${others.length} others done`);
    byId("things-list").replaceChildren(...things.map(item));
    button.disabled = done === 0;
    showSwitch();
  }

  async function toggle() {
    if (button.disabled) return;
    localStorage.setItem(HIDDEN, isHidden() ? "no" : "yes");
    showSwitch();
    await tell().catch(page.message.problem);
  }

  const tell = () => put(page.path("things"), { on: !isHidden() });

  function showSwitch() {
    setText(byId("hide-things-text"), isHidden() ? "Show done" : "Hide done");
    box.classList.toggle("hiding", isHidden());
  }

  const bindings = [
    { keys: ["Shift+B"], does: "Hide or show what is done in this scene", run: toggle, tool: "neighbours" },
  ];
  return { title: "The view", bindings, draw };
}

const WORDS = { open: "open", submitted: "done", skipped: "skipped" };

function item({ task_id: id, name, is_current: current, state, skip_reason: reason, color }) {
  const swatch = element("span", { className: "swatch", "data-state": state, "aria-hidden": "true" });
  if (state === "submitted") swatch.style.background = color;
  if (state !== "open") swatch.append(icon(state));
  const word = current ? "this one" : WORDS[state];
  const words = element("span", { className: "thing-state", title: reason ?? "" }, word);
  const props = current ? { "aria-current": "page" } : { href: `/label/${id}${location.search}` };
  return element(
    "li",
    {},
    element("a", props, swatch, element("span", { className: "thing-name" }, name), words),
  );
}
