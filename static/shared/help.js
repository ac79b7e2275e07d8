/** The keyboard overlay, written from the bindings themselves. */

import { byId, element } from "./dom.js";
import { MOD } from "./keys.js";

const SHOWN = { Mod: MOD, Escape: "Esc" };

/**
 * Fills the overlay with {group, keys, does, caps?, tool?}, `caps` standing for many keys; returns the
 * function that opens it.
 *
 * @param {GroupedBinding[]} bindings
 */
export function setUpHelp(bindings) {
  const groups = Map.groupBy(bindings, ({ group }) => group);
  byId("key-list").replaceChildren(...[...groups].map(([name, members]) => section(name, members.map(row))));
  const search = byId("key-search");
  search.addEventListener("input", () => filter(search.value.trim().toLowerCase()));
  const open = () => {
    search.value = "";
    filter("");
    byId("keys").showModal();
  };
  byId("help").addEventListener("click", open);
  return open;
}

function section(name, rows) {
  return element("section", { className: "key-group" }, element("h3", {}, name), element("dl", {}, ...rows));
}

function row(/** @type {GroupedBinding} */ { keys, does, caps, tool }) {
  const props = { "data-keys": keys.join(" "), ...(tool ? { "data-tool": tool } : {}) };
  const shown = caps ? joinedCaps(caps) : keyCaps(keys);
  return element("div", props, element("dt", {}, ...shown), element("dd", {}, does));
}

/** Shows what holds the words, and puts away the groups of which nothing is left. */
function filter(words) {
  const holds = (node) => node.textContent.toLowerCase().includes(words);
  for (const group of document.querySelectorAll(".key-group")) {
    const rows = [...group.querySelectorAll("dl > div")];
    const isWhole = holds(group.querySelector("h3"));
    for (const one of rows) one.hidden = !isWhole && !holds(one);
    group.hidden = rows.every((one) => one.hidden);
  }
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
