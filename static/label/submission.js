/** Submitting a pose; one that looks unfinished is asked about first, beside the button. */

import { byId, setText } from "../shared/dom.js";
import { percent } from "../shared/format.js";
import { possible } from "./panel.js";

const LEAST_AGREEMENT = 0.5; // a pose that is 4 mm and 4° off has about 0.7, one of 8 mm and 8° less than this

/**
 * A part of the labelling page; `submit` submits or asks.
 *
 * @param {LabelPage} page
 * @returns {Part & { submit: () => Promise<void> }}
 */
export function submissionPart(page) {
  let askedAbout = null; // the pose, as text
  // The second click of a double click on the button that was here is no answer.
  byId("unsure-submit").addEventListener("click", ({ detail: clicks }) => clicks < 2 && page.act("submit"));
  byId("unsure-leave").addEventListener("click", leave);

  async function submit() {
    const doubt = askedAbout === null ? doubtAbout(page.registration(), page.isTrial()) : null;
    if (doubt === null) await page.post("submit");
    else ask(doubt);
  }

  function ask(doubt) {
    askedAbout = poseNow();
    setText(byId("unsure-text"), `${doubt} Submit it all the same?`);
    byId("unsure").hidden = false;
  }

  const poseNow = () => JSON.stringify(page.registration().T_world_object);

  /** True if there was a question to leave. */
  function leave() {
    if (askedAbout === null) return false;
    askedAbout = null;
    byId("unsure").hidden = true;
    return true;
  }

  function draw(registration) {
    if (poseNow() !== askedAbout || !possible(registration, page.isConnected()).submit) leave();
  }

  return { draw, leave, submit };
}

/** What makes a pose look unfinished, as a sentence; null where nothing does. */
function doubtAbout({ posed_by: poser, agreement, tools }, isTrial) {
  if (isTrial) {
    // How sure to be is the participant's to decide, and what is measured; only a slip of the key is not.
    return poser === "start" ? "You have not moved the object yet, and a trial cannot be taken back." : null;
  }
  if (poser === "start") return "The object is still where it began.";
  if (!tools.includes("agreement")) return null;
  const share = agreement?.inlier_share ?? null;
  if (share === null) return "Nothing that was measured in this frame speaks for this pose.";
  if (share >= LEAST_AGREEMENT) return null;
  return `Only ${percent(Math.round(100 * share) / 100)} of the depth agrees; a right pose has 94 % or more.`;
}
