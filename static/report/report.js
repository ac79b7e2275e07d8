/** A report: of a study, or of the team's ordinary work. */

import { byId } from "../shared/dom.js";
import { messageArea } from "../shared/message.js";
import { openPage } from "../shared/page.js";
import { showStudy } from "./study.js";
import { showTeam } from "./team.js";

const message = messageArea(byId("message"));
const wanted = location.pathname.split("/").filter(Boolean).at(-1);

await openPage(message, () => (wanted === "team" ? showTeam(message) : showStudy(wanted, message)));
