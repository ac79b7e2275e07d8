/** The keyboard overlay, written from the bindings themselves. */

import { byId, element } from "../dom.js";
import { MOD } from "./keys.js";

const SHOWN = { Mod: MOD, Escape: "Esc" };

/** Fills the overlay with {keys, does, machine?}; returns the function that opens it. */
export function setUpHelp(bindings) {
  const rows = bindings.map(({ keys, does, machine }) => {
    const props = machine ? { "data-machine": "" } : {};
    return element("div", props, element("dt", {}, ...keyCaps(keys)), element("dd", {}, does));
  });
  byId("key-list").replaceChildren(...rows);
  const open = () => byId("keys").showModal();
  byId("help").addEventListener("click", open);
  return open;
}

function keyCaps(keys) {
  return keys.flatMap((chord, index) => {
    const caps = chord.split("+").flatMap((key) => [element("kbd", {}, SHOWN[key] ?? key), " "]);
    return index === 0 ? caps : ["or ", ...caps];
  });
}
