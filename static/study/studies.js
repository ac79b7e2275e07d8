/** Studies, for administrators: the list (/studies), setting one up (?new), and one of them (?study=ID). */

import { getAll } from "../shared/api.js";
import { byId, element } from "../shared/dom.js";
import { messageArea } from "../shared/message.js";
import { openPage } from "../shared/page.js";
import { showSetUp } from "./set-up.js";
import { showStudy } from "./study.js";

const message = messageArea(byId("message"));

await openPage(message, async () => {
  const asked = new URLSearchParams(location.search);
  if (asked.has("new")) await showSetUp(message);
  else if (asked.has("study")) await showStudy(asked.get("study"), message);
  else await showList();
});

async function showList() {
  const studies = await getAll("/api/studies");
  byId("studies").replaceChildren(...studies.toReversed().map(row));
  byId("no-studies").hidden = studies.length > 0;
  byId("list").hidden = false;
}

function row({ id, name, state, is_simulated: simulated, plan }) {
  const { conditions, modes, groups, tasks } = plan;
  const each = conditions.length * modes.length * tasks.length;
  const people = Object.entries(groups).map(([group, size]) => `${size} ${group}`);
  const how = simulated ? `${state}, simulated` : state;
  const cells = [how, conditions.join(", "), modes.join(", "), people.join(", "), each];
  const link = element("td", {}, element("a", { href: `/studies?study=${id}` }, name));
  return element("tr", {}, link, ...cells.map((text) => element("td", {}, String(text))));
}
