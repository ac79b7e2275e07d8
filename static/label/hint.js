/** What to do next, one hint at a time. */

const UNSURE = 0.5;
const DRAG = "Drag an arrow, square or arc until the object lies on its points";
const IN_PLACE = "Turn the view. Does it lie on its points from every side? Then submit.";

/** The hint for a registration, or an empty text. */
export function hintFor({ state, tools, can_undo: moved, confidence, snap, offer }) {
  if (state !== "open" || offer || snap?.state === "queued" || snap?.state === "running") return "";
  if (!tools.includes("snap")) return moved ? IN_PLACE : `${DRAG}.`;
  if (confidence !== null && confidence < UNSURE) {
    return "The machine is not sure. Turn the view, drag the object closer, and snap again.";
  }
  if (confidence !== null) return IN_PLACE;
  if (!moved) return `${DRAG}, roughly. Then snap.`;
  return "Roughly in place? Snap fits it to the depth image.";
}
