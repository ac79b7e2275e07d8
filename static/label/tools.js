/** The tools that a task is done with: what belongs to another one, marked `data-tool`, is put away. */

const MARKED = "[data-tool]";

/**
 * Puts away all that needs a tool other than these; the server refuses it as well.
 *
 * @param {Set<string>} tools
 */
export function showTools(tools) {
  for (const node of document.querySelectorAll(MARKED)) {
    node.classList.toggle("not-here", !tools.has(node.dataset.tool ?? ""));
  }
}
