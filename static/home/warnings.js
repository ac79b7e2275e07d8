/** The "What looked odd" dialog: what an import found strange in a dataset but took, until a lead accepts it. */

import { post } from "../shared/api.js";
import { byId, element, setText } from "../shared/dom.js";
import { count } from "../shared/format.js";
import { messageArea } from "../shared/message.js";

/**
 * Those that nobody has accepted yet.
 *
 * @param {Rest["DatasetOut"]} dataset
 */
export const openWarnings = ({ warnings }) => warnings.filter(({ accepted }) => !accepted);

/**
 * `onAccepted(dataset)` is called after a dataset's warnings were accepted.
 *
 * @param {(dataset: Rest["DatasetOut"]) => unknown} onAccepted
 */
export function setUpWarnings(onAccepted) {
  const dialog = byId("warnings");
  const message = messageArea(byId("warnings-message"));
  let dataset = null;

  byId("warnings-form").addEventListener("submit", async (event) => {
    event.preventDefault();
    try {
      await post(`/api/datasets/${dataset.id}/warnings/accept`);
      dialog.close();
      onAccepted(dataset);
    } catch (error) {
      message.problem(error);
    }
  });

  function open(of) {
    dataset = of;
    message.clear();
    const found = openWarnings(dataset);
    setText(byId("warnings-title"), `${count(found.length, "thing")} looked odd in ${dataset.name}`);
    byId("warnings-list").replaceChildren(...found.map(warningItem));
    dialog.showModal();
  }

  return { open };
}

function warningItem({ text, images }) {
  const where = images.length ? [element("small", { className: "muted" }, images.join(" · "))] : [];
  return element("li", {}, element("p", {}, `${text[0].toUpperCase()}${text.slice(1)}.`), ...where);
}
