/** What to do next, one hint at a time. */

const UNSURE = 0.5;

/** The hint for a registration, or an empty text. */
export function hintFor({ state, can_undo: moved, confidence, snap, offer }) {
  if (state !== "open" || offer || snap?.state === "queued" || snap?.state === "running") return "";
  if (confidence !== null && confidence < UNSURE) {
    return "The machine is not sure. Turn the view, drag the object closer, and snap again.";
  }
  if (confidence !== null) return "Turn the view. Does it lie on its points from every side? Then submit.";
  if (!moved) return "Drag an arrow, square or arc until the object lies roughly on its points. Then snap.";
  return "Roughly in place? Snap fits it to the depth image.";
}
