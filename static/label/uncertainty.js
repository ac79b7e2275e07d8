/** How far off the machine's pose may be, and what depth cannot tell about it. */

import { get, put } from "../shared/api.js";
import { byId, element, setText } from "../shared/dom.js";

const DEGREES = 180 / Math.PI;
const REMEMBERED = "snap6d.uncertainty";

/**
 * A part of the labelling page.
 *
 * @param {LabelPage} page
 * @returns {Part}
 */
export function uncertaintyPart(page) {
  const isShown = () => localStorage.getItem(REMEMBERED) !== "hidden";
  let viewIsThere = false;
  let snapId = null;
  byId("hide-uncertainty").addEventListener("click", toggle);
  showButton();

  function draw({ estimate_snap_id: newest }, before) {
    if (!before) tellView();
    if (newest === snapId) return;
    snapId = newest;
    if (snapId === null) byId("uncertainty").hidden = true;
    else load(snapId).catch(page.message.problem);
  }

  async function load(wanted) {
    const uncertainty = await get(page.path("uncertainty"));
    if (wanted !== snapId || uncertainty.snap_id !== snapId) return;
    const { translation, rotation, unknown } = uncertainty;
    setText(byId("uncertainty-size"), `± ${millimetres(translation)}, ± ${degrees(rotation)}`);
    byId("unknown-motions").replaceChildren(...unknown.map(({ text }) => element("li", {}, text)));
    byId("uncertainty").hidden = false;
  }

  function attach() {
    viewIsThere = true;
    tellView();
  }

  /** The view is the server's: it is told what this page remembers. */
  function tellView() {
    if (!viewIsThere || !page.registration()) return;
    put(page.path("uncertainty"), { shown: isShown() }).catch(page.message.problem);
  }

  function toggle() {
    localStorage.setItem(REMEMBERED, isShown() ? "hidden" : "shown");
    showButton();
    tellView();
  }

  function showButton() {
    setText(byId("hide-uncertainty-text"), isShown() ? "Hide" : "Show");
  }

  const bindings = [
    {
      keys: ["Shift+V"],
      does: "Hide what the machine is unsure of, and show it again",
      run: toggle,
      tool: "uncertainty",
    },
  ];
  return { title: "The machine", bindings, attach, draw };
}

const millimetres = (metres) => `${digits(metres * 1000)} mm`;
const degrees = (radians) => `${digits(radians * DEGREES)}°`;

/** As many as make sense. */
function digits(number) {
  return number.toFixed(number < 9.95 ? 1 : 0);
}
