/** What is written in a line of the set-up page, as a plan has it. */

const OPTIONAL = /\s*\(optional\)\s*(?=:|$)/i; // after the question, or at the end of the line

/**
 * "novice 8, expert 8" as [["novice", 8], ["expert", 8]]; 0 where no number is given.
 *
 * @param {string} text
 */
export function groupsOf(text) {
  return listOf(text, ",").map((part) => {
    const [, name, size] = part.match(/^(.*?)\s*(\d+)$/) ?? [null, part, "0"];
    return [name, Number(size)];
  });
}

/**
 * "Handedness (optional): left, right" as {text: "Handedness", choices: ["left", "right"], optional: true}, a line each.
 *
 * @param {string} text
 */
export function questionsOf(text) {
  return listOf(text, "\n").map((line) => {
    const [question, choices = ""] = line.replace(OPTIONAL, "").split(/:(.*)/s);
    return { text: question.trim(), choices: listOf(choices, ","), optional: OPTIONAL.test(line) };
  });
}

function listOf(text, separator) {
  return text
    .split(separator)
    .map((part) => part.trim())
    .filter(Boolean);
}
