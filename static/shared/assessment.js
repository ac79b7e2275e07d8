/** What is to be thought of an estimate: accept, look or doubt, and why; the words are the server's. */

import { element, icon } from "./dom.js";

const ICONS = { accept: "check", look: "look", doubt: "alert" };

/**
 * Shows an assessment in a node, which is hidden where there is none.
 *
 * @param {HTMLElement} node
 * @param {Rest["AssessmentOut"] | null} assessment
 */
export function drawAssessment(node, assessment) {
  const text = assessment ? sentenceOf(assessment) : "";
  node.hidden = text === "";
  if (node.dataset.text === text) return; // live regions stay quiet
  node.dataset.text = text;
  node.title = text;
  if (!assessment) return;
  const { verdict, reasons } = assessment;
  node.dataset.assessed = verdict;
  node.replaceChildren(
    icon(ICONS[verdict]),
    element("span", {}, element("strong", {}, verdict), `: ${reasons.join("; ")}`),
  );
}

/**
 * The verdict in short, with its reasons to be read on it.
 *
 * @param {Rest["AssessmentOut"]} assessment
 */
export function verdictMark(assessment) {
  const { verdict } = assessment;
  return element(
    "span",
    { className: "assessment", "data-assessed": verdict, title: sentenceOf(assessment) },
    icon(ICONS[verdict]),
    element("span", { className: "visually-hidden" }, "the machine’s last estimate: "),
    verdict,
  );
}

function sentenceOf(/** @type {Rest["AssessmentOut"]} */ { verdict, reasons }) {
  return `${verdict}: ${reasons.join("; ")}`;
}
