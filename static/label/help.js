/** The keyboard overlay, written from the bindings themselves. */

import { byId, element } from "../dom.js";
import { MOD } from "./keys.js";

const SHOWN = { Mod: MOD, Escape: "Esc" };

/** Fills the overlay with {keys, does, machine?, caps?}, `caps` standing for many keys; returns what opens it. */
export function setUpHelp(bindings) {
  const rows = bindings.map(({ keys, does, machine, caps }) => {
    const props = machine ? { "data-machine": "" } : {};
    const term = element("dt", {}, ...(caps ? joinedCaps(caps) : keyCaps(keys)));
    return element("div", props, term, element("dd", {}, does));
  });
  byId("key-list").replaceChildren(...rows);
  const open = () => byId("keys").showModal();
  byId("help").addEventListener("click", open);
  return open;
}

function keyCaps(keys) {
  return keys.flatMap((chord, index) => {
    const caps = joinedCaps(chord.split("+"));
    return index === 0 || keys.length > 2 ? caps : ["or ", ...caps];
  });
}

function joinedCaps(caps) {
  return caps.flatMap((key) => [element("kbd", {}, SHOWN[key] ?? key), " "]);
}
