/** Copying a pose from a neighbouring frame of the video, or from another operator. */

import { get } from "../shared/api.js";
import { byId, element, picture } from "../shared/dom.js";
import { POSED_BY } from "../shared/posed-by.js";

/**
 * A part of the labelling page.
 *
 * @param {LabelPage} page
 * @returns {Part}
 */
export function copyPart(page) {
  const button = byId("copy");
  const dialog = byId("copies");
  const list = byId("copy-list");

  button.addEventListener("click", show);
  list.addEventListener("keydown", (event) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    const buttons = [...list.querySelectorAll("button")];
    const present = /** @type {HTMLButtonElement} */ (document.activeElement);
    buttons[buttons.indexOf(present) + step]?.focus();
  });

  async function show() {
    if (!page.canMove()) return;
    page.message.clear();
    list.replaceChildren();
    byId("copies-none").hidden = true;
    dialog.showModal(); // at once: the next Enter is for it
    try {
      const { items } = await get(page.path("copies"));
      list.replaceChildren(...items.map(row));
      byId("copies-none").hidden = items.length > 0;
      list.querySelector("button")?.focus();
    } catch (error) {
      dialog.close();
      page.message.problem(error);
    }
  }

  function row(item) {
    const text = element(
      "span",
      { className: "copy-text" },
      element("strong", {}, nameOf(item)),
      infoOf(item),
    );
    const choice = element("button", { type: "button" }, picture(item.thumbnail_url, "copy-picture"), text);
    choice.addEventListener("click", () => copy(item));
    return element("li", {}, choice);
  }

  async function copy({ registration_id }) {
    dialog.close();
    await page.post("copy", { registration_id }).catch(page.message.problem);
  }

  function draw() {
    button.disabled = !page.canMove();
  }

  const bindings = [
    { keys: ["C"], does: "Copy the pose from another frame or operator", run: show, tool: "copy" },
  ];
  return { title: "The object", bindings, draw };
}

function nameOf({ is_neighbour: isNeighbour, scene, name, operator }) {
  return isNeighbour ? `${scene}, ${name}` : operator;
}

function infoOf({
  is_neighbour: isNeighbour,
  is_mine: isMine,
  operator,
  state,
  confidence,
  posed_by: poser,
}) {
  const whose = isMine ? "mine" : isNeighbour ? `by ${operator}` : "this task";
  const how = confidence === null ? POSED_BY[poser] : `confidence ${confidence.toFixed(2)}`;
  return [whose, state === "submitted" ? "submitted" : "not submitted yet", how].join(" · ");
}
