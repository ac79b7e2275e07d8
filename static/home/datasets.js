/** The datasets with their progress; pressing one shows only its tasks. */

import { getAll } from "../shared/api.js";
import { byId, element, icon, setText } from "../shared/dom.js";
import { count, percent } from "../shared/format.js";
import { openWarnings as warningsOf } from "./warnings.js";

const ASK_AGAIN_MS = 1000;

let timer = null;

/**
 * Shows all datasets and returns them. `choose(id or null)` is called when one is pressed; `openImport`,
 * `openRisk(dataset)` and `openWarnings(dataset)` are null for those who may not.
 */
export async function showDatasets({ selected, choose, openImport, openRisk, openWarnings }) {
  const datasets = await getAll("/api/datasets");
  const buttons = datasets.map((dataset) => datasetButton(dataset));

  const press = (id) => {
    for (const button of buttons)
      button.setAttribute("aria-pressed", button.dataset.datasetId === String(id));
  };
  for (const button of buttons) {
    button.addEventListener("click", () => {
      const id = button.getAttribute("aria-pressed") === "true" ? null : button.dataset.datasetId;
      press(id);
      choose(id);
    });
  }
  press(selected);
  const cards = datasets.map((dataset, index) => {
    const links = [objectsLink(dataset), ...(openRisk ? [riskButton(dataset, openRisk)] : [])];
    if (openWarnings && warningsOf(dataset).length) links.push(warningsButton(dataset, openWarnings));
    return element("div", {}, buttons[index], element("p", { className: "dataset-links" }, ...links));
  });
  byId("datasets").replaceChildren(...(cards.length ? cards : [nothingImported(openImport)]));
  followPreparation(datasets);
  return datasets;
}

/** Tells how far workers are with what snaps need of the objects, until they are done. */
function followPreparation(datasets) {
  clearTimeout(timer);
  for (const { id, ...dataset } of datasets) {
    const note = document.querySelector(`[data-dataset-id="${id}"] .dataset-preparation`);
    if (note) setText(note, preparationText(dataset));
  }
  if (!datasets.some(isPreparing)) return;
  timer = setTimeout(
    async () => followPreparation(await getAll("/api/datasets").catch(() => datasets)),
    ASK_AGAIN_MS,
  );
}

const isPreparing = ({ objects, objects_prepared: prepared, problems }) =>
  prepared + problems.length < objects;

function preparationText(dataset) {
  const { objects, objects_prepared: prepared, problems } = dataset;
  const doing = isPreparing(dataset) ? [`Preparing objects for snaps: ${prepared} of ${objects} done.`] : [];
  return [...doing, ...problems].join(" ");
}

function datasetButton({ id, name, scenes, tasks, tasks_submitted: submitted, calibration }) {
  const button = element("button", { type: "button", className: "dataset", "data-dataset-id": id });
  const most = Math.max(tasks, 1);
  button.append(
    element(
      "span",
      { className: "dataset-head" },
      element("span", { className: "dataset-name" }, name),
      element("span", { className: "dataset-done" }, tasks ? `${submitted} of ${tasks}` : "no tasks"),
    ),
    element("progress", { className: "human", max: most, value: submitted, "aria-label": "Submitted" }),
    element("small", {}, count(scenes, "scene")),
    element("small", { className: "dataset-preparation", role: "status" }),
    ...(calibration ? [element("small", {}, calibrationText(calibration))] : []),
  );
  return button;
}

/** "5 objects · 2 with suggested symmetries": leads to one that nobody has decided about, if there is one. */
function objectsLink({ id, name, objects, suggestions_open: open }) {
  const link = element("a", { href: `/objects?dataset_id=${id}` }, count(objects, "object"));
  link.setAttribute("aria-label", `Objects of ${name}`);
  if (open) link.append(" · ", icon("machine"), `${open} with suggested symmetries`);
  return link;
}

/** "risk 5 %", with a sign where no confidence bears it out. */
function riskButton(dataset, openRisk) {
  const { name, risk, acceptance } = dataset;
  const props = { type: "button", className: "link", onclick: () => openRisk(dataset) };
  const button = element("button", props, `risk ${percent(risk)}`);
  button.setAttribute("aria-haspopup", "dialog");
  button.setAttribute("aria-label", `Risk of ${name}: ${percent(risk)}`);
  if (acceptance.threshold === null) {
    button.append(icon("alert"));
    button.title = "No confidence bears it out";
  }
  return button;
}

/** "2 odd things", with a sign: leads to what they are. */
function warningsButton(dataset, openWarnings) {
  const props = { type: "button", className: "link", onclick: () => openWarnings(dataset) };
  const button = element("button", props, count(warningsOf(dataset).length, "odd thing"), icon("alert"));
  button.setAttribute("aria-haspopup", "dialog");
  button.setAttribute("aria-label", `What looked odd in ${dataset.name}`);
  return button;
}

function calibrationText({ registrations, is_current: isCurrent }) {
  const from = `calibrated from ${count(registrations, "registration")}`;
  return isCurrent ? from : `${from} with an earlier version: calibrate again`;
}

function nothingImported(openImport) {
  const box = element("div", { className: "panel empty small" });
  if (openImport) {
    const props = { type: "button", className: "button human", onclick: openImport };
    box.append(
      element("p", {}, "Nothing here yet. Import a dataset in BOP layout to begin."),
      element("button", props, "Import a dataset"),
    );
  } else {
    box.append(element("p", {}, "Nothing here yet. An administrator has to import a dataset first."));
  }
  return box;
}
