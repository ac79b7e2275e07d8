/** The same curves from ordinary work, with figures and an advice for each operator. */

import { get } from "../shared/api.js";
import { byId, element, setText } from "../shared/dom.js";
import { count } from "../shared/format.js";
import { ERROR_FIELD, errorsOf, setUpChoices } from "./choices.js";
import { digits, secondsText, shareText } from "./numbers.js";
import { curvesSection, drawPanels } from "./panels.js";
import { remarksSection, section, tableOf } from "./tables.js";

const URL_OF_TEAM = "/api/reports/team";
const NAMES = { human: "as done", default: "the machine's poses" };

/**
 * @param {Message} message
 */
export async function showTeam(message) {
  const { choices } = await get(URL_OF_TEAM);
  document.title = "Team · Report · Snap6D";
  setText(byId("title"), "The team's work");
  setText(byId("crumb"), "Report of the team");
  const field = (name, label) => ({ name, label, options: choices[name], all: true });
  await setUpChoices(
    [field("operator", "Operator"), field("object", "Object"), field("week", "Week"), ERROR_FIELD],
    async ({ error, ...asked }) => {
      try {
        draw(await get(URL_OF_TEAM, asked), { errors: errorsOf({ error }), isSimulated: false });
      } catch (problem) {
        message.problem(problem);
      }
    },
  );
}

function draw(team, which) {
  const registrations = team.rows.reduce((sum, row) => sum + row.registrations, 0);
  setText(
    byId("about"),
    `${count(registrations, "registration")} · the last pose of each counts as its truth · idle time is left out`,
  );
  drawPanels(team.cells, NAMES, which);
  byId("sections").replaceChildren(
    section("When to let the machine take over", advice(team.advice)),
    section("Figures", figures(team.rows)),
    remarksSection(team.remarks),
    curvesSection(team.cells, NAMES, which),
  );
}

function advice(lines) {
  if (lines.length === 0) return element("p", {}, "Nothing is submitted yet.");
  return element(
    "ul",
    {},
    ...lines.map(({ operator, text }) => element("li", {}, element("strong", {}, operator), ` ${text}`)),
  );
}

function figures(rows) {
  const head = [
    "operator",
    "object",
    "week",
    "registrations",
    "time each, without idle",
    "snaps each",
    "machine poses accepted",
    "drags after the snap",
  ];
  return tableOf(
    head,
    rows.map((row) => [
      row.operator,
      row.object,
      row.week,
      row.registrations,
      secondsText(row.active_seconds),
      digits(row.snaps),
      shareText(row.accepted),
      digits(row.drags_after),
    ]),
  );
}
