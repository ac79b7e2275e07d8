/** What to do next, one hint at a time; each fits on one line of the panel. */

const UNSURE = 0.5;
const IN_PLACE = "Right from every side? Then submit.";

/**
 * The hint for a registration, or an empty text.
 *
 * @param {Registration} registration
 */
export function hintFor({ state, tools, can_undo: moved, confidence, snap, offer }) {
  if (state !== "open" || offer || snap?.state === "queued" || snap?.state === "running") return "";
  if (!tools.includes("snap")) return moved ? IN_PLACE : "Drag the object onto its points.";
  if (confidence !== null && confidence < UNSURE) return "Not sure: drag it closer, and snap again.";
  if (confidence !== null) return IN_PLACE;
  return moved ? "Roughly in place? Then snap." : "Drag the object near its points, then snap.";
}
