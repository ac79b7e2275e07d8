/** What is wrong in a form, in one sentence under the field that it is about. */

import { setText } from "../shared/dom.js";

const FIELDS = { tasks: "things", practice: "things", break_after: "break-after" }; // of parts that are called otherwise

/**
 * Shows `problems`, by the fields' ids, in the elements whose ids end with "-problem"; takes back all others.
 *
 * @param {HTMLFormElement} form
 * @param {Record<string, string>} problems
 */
export function showProblems(form, problems) {
  for (const place of form.querySelectorAll("[id$='-problem']")) {
    const id = place.id.replace("-problem", "");
    setText(place, problems[id] ?? "");
    place.hidden = !problems[id];
    const field = form.querySelector(`#${id}`);
    if (field?.matches("input, textarea")) field.setAttribute("aria-invalid", String(Boolean(problems[id])));
  }
}

/**
 * Leads to the first field that has a problem.
 *
 * @param {HTMLFormElement} form
 */
export function goToFirst(form) {
  const place = form.querySelector("[id$='-problem']:not([hidden])");
  const field = form.querySelector(`#${place?.id.replace("-problem", "")}`);
  (field?.querySelector("input") ?? field)?.focus();
  place?.scrollIntoView({ block: "center" });
}

/**
 * The server's "body.plan.questions.1.choices: left is the only choice." as ["questions", "Question 2: left is…"]; the
 * field is empty where the sentence is about the plan as a whole, or about none of its parts.
 *
 * @param {string} sentence
 */
export function placedProblem(sentence) {
  const [, part, index, text] =
    sentence.match(/^body(?:\.plan)?(?:\.([a-z_]+)(?:\.(\d+))?)?[^:]*: (.*)$/s) ?? [];
  if (text === undefined) return ["", sentence];
  const said = part === "questions" && index ? `Question ${Number(index) + 1}: ${text}` : text;
  return [FIELDS[part] ?? part ?? "", said[0].toUpperCase() + said.slice(1)];
}
