/** A snap under way: whether it waits for a worker, or keeps one long, and since when. */

import { get } from "../shared/api.js";
import { byId, setText } from "../shared/dom.js";

const PATIENCE_MS = 2000;
const ASK_AGAIN_MS = 1000;
const LONG_SECONDS = { default: 10, paper: 60 };
const PREPARING = "This object is being prepared for snaps, which happens once.";
const NO_WORKER = "No worker is there; Snap works again when one is up. You can go on by hand.";
const SLOW = "The worker takes long. You can go on by hand, or cancel.";

let told = { id: null, text: "" };

/**
 * @param {Pick<Registration, "snap">} registration
 */
export function isSnapping({ snap }) {
  return snap?.state === "queued" || snap?.state === "running";
}

/**
 * What there is to say of a snap that takes longer than usual, or null.
 *
 * @param {{ id: string | null }} snap
 */
export function waitingText({ id }) {
  return id !== null && id === told.id ? told.text : null;
}

/**
 * What there is to say of a snap that a worker is at.
 *
 * @param {{ method: Registration["method"] }} snap
 */
export function snappingText({ method }) {
  return method === "paper" ? "The paper’s filter runs…" : "Snapping…";
}

/**
 * A part of the labelling page.
 *
 * @returns {Part}
 */
export function waitingPart() {
  let followed = null;
  let timer = null;

  function draw(registration) {
    const snap = isSnapping(registration) ? registration.snap : null;
    const id = snap?.id ?? null;
    if (id === followed) return;
    followed = id;
    tell(null, "", "");
    clearTimeout(timer);
    if (id !== null) timer = setTimeout(ask, PATIENCE_MS, id, snap.method);
  }

  async function ask(id, method) {
    // Where the server does not answer, the page has said so: what follows here would only repeat it.
    const snap = await get(`/api/snaps/${id}`).catch(() => null);
    if (id !== followed) return;
    if (snap?.standing) {
      tell(id, textFor(snap.state, method, snap.standing), `${Math.round(snap.standing.seconds)} s`);
      setText(byId("snap-status"), told.text);
    }
    timer = setTimeout(ask, ASK_AGAIN_MS, id, method);
  }

  return { draw };
}

/** The seconds stand apart, since they are not to be read out again and again. */
function tell(id, text, seconds) {
  told = { id, text };
  setText(byId("snap-seconds"), seconds);
}

/**
 * @param {string} state
 * @param {Registration["method"]} method
 * @param {Rest["Standing"]} standing
 */
function textFor(state, method, { workers, ahead, seconds, preparing }) {
  if (state === "running") return seconds < LONG_SECONDS[method] ? snappingText({ method }) : SLOW;
  if (workers === 0) return NO_WORKER;
  if (preparing) return PREPARING;
  return `All workers are busy; ${ahead === 0 ? "yours is next" : `${ahead} before you`}.`;
}
