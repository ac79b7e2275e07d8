/** Draws a registration into the panel; knows nothing of the server. */

import { drawAssessment } from "../shared/assessment.js";
import { byId, setText } from "../shared/dom.js";
import { framesText } from "../shared/format.js";
import { drawPoser } from "../shared/posed-by.js";
import { hintFor } from "./hint.js";
import { isSnapping, snappingText, waitingText } from "./waiting.js";

const SNAP_STATUS = {
  queued: "Waiting for a worker…",
  cancelled: "Snap cancelled. The pose is as you left it.",
  failed: "The snap failed.",
};

const UNASKED = {
  queued: "The machine looks…",
  running: "The machine looks…",
  cancelled: "",
  failed: "The machine finds nothing from here.",
};

/**
 * What can be done now, by action.
 *
 * @param {Registration | null} registration
 * @param {boolean} connected
 */
export function possible(registration, connected) {
  const open = registration?.state === "open" && connected;
  const tools = registration?.tools ?? [];
  const has = (tool) => open && tools.includes(tool);
  const shown = registration?.offer ?? registration?.live ?? null;
  return {
    snap: has("snap"),
    live: has("live snap"),
    find: has("find it"),
    cancel: open && isSnapping(registration),
    undo: open && registration.can_undo,
    redo: open && registration.can_redo,
    reset: open && registration.can_undo,
    submit: open && !isSnapping(registration) && !registration.dragging,
    skip: has("ending") && !registration?.dragging,
    reopen: connected && registration !== null && registration.state !== "open",
    "offer-accept": open && shown !== null,
    "offer-dismiss": open && registration.offer !== null,
  };
}

/**
 * @param {Registration} registration
 * @param {boolean} connected
 */
export function drawPanel(registration, connected) {
  for (const [id, can] of Object.entries(possible(registration, connected))) byId(id).disabled = !can;
  drawSaved(registration, connected);
  drawConfidence(registration);
  drawSnap(registration);
  drawOffer(registration);
  setText(byId("hint"), hintFor(registration));
  byId("finish").hidden = registration.state !== "open";
  byId("submitted").hidden = registration.state === "open";
}

function drawSaved({ dragging }, connected) {
  byId("saved").dataset.saved = connected && !dragging;
  setText(byId("saved-text"), !connected ? "offline" : dragging ? "moving…" : "saved");
}

function drawConfidence({ confidence, assessment, posed_by: poser }) {
  drawAssessment(byId("assessment"), assessment);
  const meter = byId("confidence");
  const known = confidence !== null;
  const text = known ? confidence.toFixed(2) : "–";
  meter.setAttribute("aria-valuenow", confidence ?? 0);
  meter.setAttribute("aria-valuetext", known ? text : "no estimate of the machine");
  byId("confidence-fill").style.setProperty("--share", confidence ?? 0);
  setText(byId("confidence-number"), text);
  drawPoser(byId("source"), poser);
}

function drawSnap(registration) {
  const { snap } = registration;
  const bar = byId("progress");
  const running = isSnapping(registration);
  bar.classList.toggle("running", running);
  if (running && snap.state === "queued") bar.removeAttribute("value");
  else bar.value = running ? snap.progress : 0;
  setText(byId("snap-status"), snapStatus(registration));
}

function snapStatus({ state, snap, offer, confidence, method, methods }) {
  if (state !== "open") return "";
  const isChosen =
    method === "paper" && methods.length > 1 && (!snap || (snap.state === "done" && snap.method !== method));
  if (isChosen && !offer) return "Snap is by the paper’s filter now: 5 to 10 s.";
  if (!snap) return "";
  if (snap.state !== "done") {
    if (snap.asked_by === "machine") return waitingText(snap) ?? UNASKED[snap.state];
    return waitingText(snap) ?? (snap.state === "running" ? snappingText(snap) : SNAP_STATUS[snap.state]);
  }
  if (offer?.quiet) return "";
  if (offer) return "You moved the object meanwhile: the result is offered.";
  const how = snap.method === "paper" ? "Snapped by the paper’s filter" : "Snapped";
  const seen = framesText(snap.frames);
  return confidence === null ? "" : `${how}, confidence ${confidence.toFixed(2)}${seen && ` · ${seen}`}.`;
}

function drawOffer({ offer, state }) {
  byId("offer").hidden = !offer || offer.quiet || state !== "open";
  if (!offer) return;
  setText(byId("offer-confidence"), offer.confidence.toFixed(2));
  drawAssessment(byId("offer-assessment"), offer.assessment);
}
