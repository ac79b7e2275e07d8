/** The frames that Snap uses: those that see the object, or this one alone, as this browser remembers. */

import { byId } from "../shared/dom.js";

const REMEMBERED = "snap6d.snap-frames";

/**
 * A part of the labelling page.
 *
 * @param {LabelPage} page
 * @returns {Part}
 */
export function snapFramesPart(page) {
  const button = byId("this-frame-only");
  let isChanging = false;
  button.addEventListener("click", toggle);

  function draw({ frame_use: use, frame_uses: uses, state }, before) {
    const hasChoice = uses.length > 1;
    byId("snap-frames").hidden = !hasChoice || state !== "open";
    button.setAttribute("aria-pressed", use === "current");
    button.disabled = !page.isConnected();
    const remembered = localStorage.getItem(REMEMBERED);
    if (!before && hasChoice && uses.includes(remembered) && remembered !== use) change(remembered);
  }

  function toggle() {
    const { frame_use: use, frame_uses: uses } = page.registration();
    if (uses.length < 2 || isChanging || !page.isConnected()) return;
    const wanted = use === "current" ? "auto" : "current";
    localStorage.setItem(REMEMBERED, wanted);
    change(wanted);
  }

  async function change(frames) {
    if (isChanging) return;
    isChanging = true;
    await page.put("snap-frames", { frames }).catch(page.message.problem);
    isChanging = false;
  }

  const bindings = [
    {
      keys: ["Shift+T"],
      does: "Snap with this frame only, or with all that see the object",
      run: toggle,
      tool: "snap",
    },
  ];
  return { title: "The machine", bindings, draw };
}
