/** Keys that work wherever the focus is, in this page and in the iframe of the 3-D view. */

/** How the Ctrl or Cmd key is called here. */
export const MOD = /Mac|iPhone|iPad/.test(navigator.platform) ? "⌘" : "Ctrl";

/**
 * Makes `attach(window)` for bindings {keys: ["Mod+Z"], run, repeats?, tool?}; `run` is handed the key and
 * whether it repeats because it is held down. A binding works where `isHere(binding)`.
 *
 * "Mod" is Ctrl or Cmd. viser takes W A S D Q E and the arrows for its camera, so no binding may.
 *
 * @param {Binding[]} bindings
 * @param {(binding: Binding) => boolean} [isHere]
 * @returns {(target: Window) => void}
 */
export function keyBindings(bindings, isHere = (_binding) => true) {
  const byChord = new Map(bindings.flatMap((binding) => binding.keys.map((key) => [key, binding])));

  function onKeyDown(event) {
    const pressed = chord(event);
    const binding = byChord.get(pressed);
    if (!binding || !isHere(binding) || belongsToControl(event) || document.querySelector("dialog[open]"))
      return;
    event.preventDefault();
    event.stopPropagation();
    if (!event.repeat || binding.repeats) binding.run(pressed, event.repeat);
  }

  return (target) => target.addEventListener("keydown", onKeyDown, { capture: true });
}

/**
 * "Mod+Shift+Z", "Space", "?": Shift is named only where it does not already change the character.
 *
 * @param {Pick<KeyboardEvent, "key" | "code" | "ctrlKey" | "metaKey" | "altKey" | "shiftKey">} event
 */
export function chord(event) {
  const key = keyName(event);
  const letterOrNamed = /^[A-Z]$|^..+$/.test(key);
  const parts = [
    (event.ctrlKey || event.metaKey) && "Mod",
    event.altKey && "Alt",
    event.shiftKey && letterOrNamed && "Shift",
    key,
  ];
  return parts.filter(Boolean).join("+");
}

/** With Alt, a Mac types other characters: the key's own letter counts. */
function keyName({ key, code, altKey }) {
  if (altKey && /^Key[A-Z]$/.test(code) && !/^[a-z]$/i.test(key)) return code.at(-1);
  if (key === " ") return "Space";
  return key.length === 1 ? key.toUpperCase() : key;
}

/** Typing stays typing, and Space or Enter on a focused button press that button. */
function belongsToControl(event) {
  const target = event.composedPath()[0];
  if (!target?.closest) return false;
  if (target.closest("input:not([type='range']), textarea, select, [contenteditable]")) return true;
  return (event.key === " " || event.key === "Enter") && target.closest("button, a, summary") !== null;
}

/**
 * Gives the focus back after a press by mouse, so that the next Space is a snap and not the same button.
 *
 * @param {Document} root
 */
export function releaseFocusAfterPointer(root) {
  root.addEventListener("click", (event) => {
    const byPointer = event.detail > 0;
    if (byPointer) /** @type {HTMLElement} */ (event.target).closest("button, summary")?.blur();
  });
}
