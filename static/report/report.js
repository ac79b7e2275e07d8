/** A report: of a study, or of the team's ordinary work. */

import { showAccount } from "../account.js";
import { byId } from "../dom.js";
import { messageArea } from "../message.js";
import { showStudy } from "./study.js";
import { showTeam } from "./team.js";

const message = messageArea(byId("message"));
const wanted = location.pathname.split("/").filter(Boolean).at(-1);

try {
  await showAccount();
  await (wanted === "team" ? showTeam(message) : showStudy(wanted, message));
} catch (error) {
  message.problem(error, { label: "Try again", run: () => location.reload() });
}
