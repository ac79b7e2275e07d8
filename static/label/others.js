/** Who else has this task open now; each works on a registration of their own. */

import { byId, setText } from "../shared/dom.js";

/**
 * A part of the labelling page.
 *
 * @returns {Part}
 */
export function othersPart() {
  function draw({ others }) {
    const [first, ...rest] = others;
    const who =
      rest.length === 0
        ? `${first} is`
        : `${first} and ${rest.length === 1 ? rest[0] : `${rest.length} others`} are`;
    setText(byId("others"), first ? `${who} working on this task, too` : "");
    byId("others").title = others.join(", ");
  }

  return { draw };
}
