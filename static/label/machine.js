/**
 * What the machine does of its own accord: live snapping, taking over in `auto`, and what it suggests quietly.
 */

import { drawAssessment } from "../shared/assessment.js";
import { byId, setText } from "../shared/dom.js";
import { MOD } from "../shared/keys.js";
import { possible } from "./panel.js";

const REMEMBERED = "snap6d.live";

/**
 * A part of the labelling page.
 *
 * @param {LabelPage} page
 * @returns {Part}
 */
export function machinePart(page) {
  let switching = false;
  byId("live").addEventListener("click", toggle);
  byId("note-accept").addEventListener("click", () => page.act("offer-accept"));
  byId("note-undo").addEventListener("click", () => page.act("undo"));
  setText(byId("note-undo-key"), `${MOD} Z`);

  const isWanted = () => localStorage.getItem(REMEMBERED) === "on";
  const isPossible = (registration) => possible(registration, page.isConnected()).live;

  function draw(registration, before) {
    const { is_live: isLive } = registration;
    byId("live").setAttribute("aria-pressed", isLive);
    drawNote(noteFor(registration));
    const fresh = !before || (before.is_live && !isLive); // the page, or the server, has just come up
    if (fresh && isWanted() && !isLive && isPossible(registration)) change(true);
  }

  function toggle() {
    const registration = page.registration();
    if (!isPossible(registration)) return;
    localStorage.setItem(REMEMBERED, registration.is_live ? "off" : "on");
    change(!registration.is_live);
  }

  async function change(on) {
    if (switching) return;
    switching = true;
    await page.put("live", { on }).catch(page.message.problem);
    switching = false;
  }

  const bindings = [
    {
      keys: ["V"],
      does: "Live on or off: a ghost shows where a snap would land",
      run: toggle,
      tool: "live snap",
    },
  ];
  return { title: "The machine", bindings, draw };
}

/** What there is to say in the view: {kind, text, confidence, assessment}, or null. */
function noteFor({ state, offer, live, snap, confidence, assessment, dragging }) {
  if (state !== "open") return null;
  if (live) return { kind: "live", text: "A snap would land at the ghost", ...live };
  if (offer)
    return offer.quiet ? { kind: "suggested", text: "The machine suggests the ghost", ...offer } : null;
  const tookOver = snap?.state === "done" && snap.asked_by === "machine";
  if (!tookOver || confidence === null || dragging) return null;
  return { kind: "taken", text: "The machine took over", confidence, assessment };
}

function drawNote(note) {
  const box = byId("note");
  box.hidden = note === null;
  if (note === null) return;
  // What changes many times a second is not read out.
  box.setAttribute("aria-live", note.kind === "live" ? "off" : "polite");
  box.dataset.kind = note.kind;
  setText(byId("note-text"), `${note.text}, confidence `);
  setText(byId("note-confidence"), note.confidence.toFixed(2));
  drawAssessment(byId("note-assessment"), note.assessment);
  byId("note-accept").hidden = note.kind === "taken";
  byId("note-undo").hidden = note.kind !== "taken";
}
