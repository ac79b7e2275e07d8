/** The report of a study. */

import { get } from "../shared/api.js";
import { byId, element, setText } from "../shared/dom.js";
import { count, METHODS } from "../shared/format.js";
import { ERROR_FIELD, errorsOf, setUpChoices } from "./choices.js";
import { digits, errorText, intervalText, secondsText, shareText } from "./numbers.js";
import { curvesSection, drawPanels, linesOf } from "./panels.js";
import { remarksSection, section, tableOf, withCaution } from "./tables.js";

const NAMES = { human: "human", default: "STG", paper: "STG, paper’s filter" };

/**
 * @param {string | null | undefined} studyId
 * @param {Message} message
 */
export async function showStudy(studyId, message) {
  const url = /** @type {const} */ (`/api/reports/${studyId}`);
  let newest = 0;

  async function show({ error, condition, ...asked }) {
    newest += 1;
    const turn = newest;
    byId("panels").setAttribute("aria-busy", "true");
    try {
      const report = await get(url, asked);
      if (turn !== newest) return; // another choice was made meanwhile
      draw(of(report, condition), url, { ...asked, condition }, errorsOf({ error }));
      message.clear();
    } catch (problem) {
      message.problem(problem);
    }
    byId("panels").removeAttribute("aria-busy");
  }

  const { name, choices } = await get(url);
  document.title = `${name} · Report · Snap6D`;
  setText(byId("title"), name);
  setText(byId("crumb"), `Report of ${name}`);
  const field = (key, label, more = { all: true }) => ({ name: key, label, options: choices[key], ...more });
  await setUpChoices(
    [
      field("group", "Group"),
      field("mode", "Mode"),
      field("condition", "Condition", { all: choices.condition.length === 0, chosen: "manual" }),
      ERROR_FIELD,
      field("scene", "Scene"),
      field("object", "Object"),
      {
        name: "without_idle",
        label: "Idle time",
        options: [
          ["false", "counts"],
          ["true", "left out"],
        ],
      },
      {
        name: "truth",
        label: "Truth",
        options: [
          ["operators", "mean by hand"],
          ["reference", "reference pose"],
        ],
      },
    ],
    show,
  );
}

/** With the curves of one condition; what compares conditions stays. */
function of(report, condition) {
  const isShown = (part) => condition === "" || part.condition === condition;
  return { ...report, cells: report.cells.filter(isShown), gains: report.gains.filter(isShown) };
}

function draw(report, url, asked, errors) {
  const which = { errors, isSimulated: report.is_simulated };
  byId("simulated").hidden = !report.is_simulated;
  const groups = Object.entries(report.groups).map(([name, n]) => `${name}: ${count(n, "operator")}`);
  setText(byId("about"), [count(report.trials, "trial"), ...groups].join(" · "));
  drawPanels(report.cells, NAMES, which);
  byId("sections").replaceChildren(
    ...[rotation, handOffs, fitts, comparisons, truths]
      .map((part) => part(report))
      .filter((one) => one !== null),
    remarksSection(report.remarks),
    method(report),
    downloads(report, url, asked),
    curvesSection(report.cells, NAMES, which),
  );
}

const cellOf = ({ group, mode, condition, error }) => [group, mode, condition, error];

function rotation({ gains }) {
  if (gains.length === 0) return null;
  const answers = gains.filter(({ error }) => error === "rotation");
  const rows = gains.map((gain) => {
    const told = (value) => errorText(value, gain.error);
    const intervals = ["before", "after", "gain"].map((name) => intervalText(gain[name], told));
    return [
      ...cellOf(gain),
      METHODS[gain.method].name,
      gain.moment,
      ...intervals,
      shareText(gain.improved),
      gain.gain.operators,
      gain.verdict,
    ];
  });
  const head = [
    "group",
    "mode",
    "condition",
    "error",
    "method",
    "from",
    "before",
    "after",
    "gain",
    "better",
    "operators",
    "verdict",
  ];
  return section(
    "Does a snap improve rotation as well?",
    element("ul", {}, ...answers.map(({ sentence }) => element("li", {}, sentence))),
    tableOf(head, rows),
  );
}

function handOffs({ cells }) {
  const rows = cells.flatMap((cell) =>
    Object.entries(cell.stg).flatMap(([method, { hand_off: point }]) => {
      const which = [...cellOf(cell), METHODS[method].name];
      if (point === null) return [[...which, "no margin: nothing is saved for sure", "–", "–"]];
      const [low, high] = point.saved_interval;
      const saved = intervalText({ mean: point.saved, low, high }, secondsText);
      const from = `${errorText(point.margin, cell.error)}${point.is_largest ? " or more" : ""}`;
      return withCaution([...which, from, errorText(point.best_margin, cell.error), saved], point.caution);
    }),
  );
  const head = [
    "group",
    "mode",
    "condition",
    "error",
    "method",
    "let the machine take over from",
    "saves most at",
    "seconds saved there",
  ];
  return rows.length ? section("Hand-off", tableOf(head, rows)) : null;
}

function fitts({ cells }) {
  const rows = cells.flatMap((cell) =>
    linesOf(cell).flatMap(({ hand, fitts: line, fitts_caution: caution }) =>
      withCaution(
        [...cellOf(cell), NAMES[hand], ...(line ? numbersOf(line, cell.error) : Array(6).fill("–"))],
        caution,
      ),
    ),
  );
  const head = ["group", "mode", "condition", "error", "by", "D", "margins", "a", "b a bit", "R²", "bits/s"];
  return rows.length ? section("Fitts' law: time = a + b log2(D/W + 1)", tableOf(head, rows)) : null;
}

function numbersOf(line, error) {
  const told = (name, text) => {
    const [low, high] = line[`${name}_interval`];
    return intervalText({ mean: line[name], low, high }, text);
  };
  const [a, b, bits] = [told("a", secondsText), told("b", secondsText), told("throughput", digits)];
  return [errorText(line.distance, error), line.margins, a, b, digits(line.r_squared), bits];
}

function comparisons({ comparisons: pairs }) {
  const rows = pairs.map((pair) => [
    pair.group,
    pair.mode,
    `${pair.second} − ${pair.first}`,
    pair.pairs,
    pair.seconds.operators,
    intervalText(pair.seconds, secondsText),
    intervalText(pair.translation, (value) => errorText(value, "translation")),
    intervalText(pair.rotation, (value) => errorText(value, "rotation")),
  ]);
  const head = [
    "group",
    "mode",
    "difference",
    "pairs",
    "operators",
    "seconds",
    "final translation",
    "final rotation",
  ];
  return rows.length ? section("Conditions in pairs", tableOf(head, rows)) : null;
}

function truths({ truths: places }) {
  const both = (translation, turn) =>
    `${errorText(translation, "translation")}, ${errorText(turn, "rotation")}`;
  const rows = places.map((place) => [
    place.name,
    place.registrations || "given",
    both(place.translation_spread, place.rotation_spread),
    place.from_reference === null ? "–" : both(...place.from_reference),
  ]);
  return rows.length
    ? section("Ground truth", tableOf(["object", "registrations", "spread", "off the reference"], rows))
    : null;
}

function method({ config, algorithm, cells }) {
  const paper = cells.some(({ stg }) => stg.paper)
    ? `, by the paper’s filter with ${config.paper_seconds} s`
    : "";
  return section(
    "How the numbers are made",
    element(
      "p",
      {},
      `Each offline snap is charged with ${config.snap_seconds} s${paper}${algorithm ? `; they are of algorithm ${algorithm}` : ""}. Idle time ${config.without_idle ? "is left out" : "counts"}. ` +
        `Intervals hold 95 %, by bootstrap over operators with seed ${config.seed}. Means are over operators who come within a margin.`,
    ),
  );
}

/** The figure is of the condition that is shown; the page and the tables are of all, which they compare. */
function downloads({ tables }, url, { condition, ...asked }) {
  const link = (name, text, wanted = asked) => {
    const given = Object.entries(wanted).filter(([, value]) => value !== "");
    return element("a", { href: `${url}/files/${name}?${new URLSearchParams(given)}`, download: "" }, text);
  };
  const figure = { ...asked, condition };
  const rows = tables.map((name) => [
    name.replace("_", "-"),
    link(`${name}.csv`, "CSV"),
    link(`${name}.parquet`, "Parquet"),
  ]);
  return section(
    "Download",
    element(
      "p",
      { className: "row" },
      link("figure.svg", "Figure (SVG)", figure),
      link("figure.pdf", "Figure (PDF)", figure),
      link("report.html", "Report (HTML)"),
    ),
    tableOf(["table", "CSV", "Parquet"], rows),
  );
}
