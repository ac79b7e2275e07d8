/** The keyboard overlay, written from the bindings themselves. */

import { byId, element } from "../dom.js";

const SHOWN = { Mod: /Mac|iPhone|iPad/.test(navigator.platform) ? "⌘" : "Ctrl", Escape: "Esc" };

/** Fills the overlay with {keys, does, caps?}, `caps` standing for many keys; returns the function that opens it. */
export function setUpHelp(bindings) {
  const rows = bindings.map(({ keys, does, caps }) =>
    element("div", {}, element("dt", {}, ...(caps ? joinedCaps(caps) : keyCaps(keys))), element("dd", {}, does)),
  );
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
