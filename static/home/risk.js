/** The "Risk" dialog: how many wrong poses a dataset allows the machine to accept, and what that asks for. */

import { get, put } from "../shared/api.js";
import { byId, element, icon, setText } from "../shared/dom.js";
import { count, percent } from "../shared/format.js";
import { messageArea } from "../shared/message.js";

const CHOICES = [0.01, 0.02, 0.05, 0.1];
const OTHER = "other";

/**
 * `onSet(dataset)` is called after a dataset's risk was set.
 *
 * @param {(dataset: Rest["DatasetOut"]) => unknown} onSet
 */
export function setUpRisk(onSet) {
  const dialog = byId("risk");
  const message = messageArea(byId("risk-message"));
  let dataset = null;
  let request = 0;

  byId("risk-choices").addEventListener("change", () => {
    byId("risk-other").hidden = chosen() !== OTHER;
    if (chosen() === OTHER) byId("risk-percent").select();
    guarded(show);
  });
  byId("risk-percent").addEventListener("input", () => guarded(show));
  byId("risk-form").addEventListener("submit", (event) => {
    event.preventDefault();
    guarded(set);
  });

  function open(of) {
    dataset = of;
    const { name, risk, risk_is_set: isSet, risk_of_settings: ofSettings } = dataset;
    const present = !isSet ? "" : CHOICES.includes(risk) ? String(risk) : OTHER;
    const words = [
      ["", `as the settings say (${percent(ofSettings)})`],
      ...CHOICES.map((one) => [String(one), percent(one)]),
    ];
    const choices = [...words, [OTHER, "other"]].map(([value, text]) =>
      choice(value, text, value === present),
    );
    setText(byId("risk-title"), `Risk of ${name}`);
    byId("risk-choices").replaceChildren(...choices);
    byId("risk-other").hidden = present !== OTHER;
    byId("risk-percent").value = String(Number((100 * risk).toPrecision(4)));
    dialog.showModal();
    ticked()?.focus();
    guarded(show);
  }

  /** What is chosen, as a share; null: as the settings say. */
  function wanted() {
    if (chosen() !== OTHER) return chosen() === "" ? null : Number(chosen());
    const field = byId("risk-percent");
    if (!field.value || !field.validity.valid) throw new Error("Give a number of percent from 0.01 to 99.");
    return field.valueAsNumber / 100;
  }

  async function show() {
    const mine = ++request;
    const risk = wanted() ?? dataset.risk_of_settings;
    const found = await get(`/api/datasets/${dataset.id}/acceptance`, { risk });
    if (mine === request) draw(found, dataset); // else a newer choice was made meanwhile
  }

  async function set() {
    const changed = await put(`/api/datasets/${dataset.id}/risk`, { risk: wanted() });
    dialog.close();
    await onSet(changed);
  }

  async function guarded(work) {
    message.clear();
    try {
      await work();
    } catch (error) {
      byId("risk-meaning").hidden = byId("risk-found").hidden = true; // they speak of another choice
      message.problem(error);
    }
  }

  return { open };
}

const ticked = () => [...byId("risk-choices").querySelectorAll("input")].find(({ checked }) => checked);
const chosen = () => ticked()?.value;

function choice(value, text, checked) {
  const radio = element("input", { type: "radio", name: "risk", value, checked });
  return element("label", {}, radio, element("span", {}, text));
}

function draw({ risk, threshold, is_own: isOwn, rests_on: restsOn, needs }, { name, calibration }) {
  const allowed = percent(risk);
  const isKnown = threshold !== null;
  byId("risk-meaning").hidden = byId("risk-found").hidden = false;
  setText(
    byId("risk-meaning"),
    `The machine takes over only where at most ${allowed} of such poses are wrong.`,
  );
  byId("risk-threshold").dataset.assessed = isKnown ? "accept" : "doubt";
  byId("risk-threshold").replaceChildren(
    icon(isKnown ? "check" : "alert"),
    element(
      "span",
      {},
      isKnown
        ? askedFor(threshold)
        : `No confidence is known to bear ${allowed} out: the machine never takes over.`,
    ),
  );
  const source = isOwn
    ? `So say ${count(restsOn, "registration")} of this dataset, which calibrate it.`
    : `So says the calibration that comes with Snap6D, made of ${count(restsOn, "estimate")}.`;
  setText(byId("risk-source"), [source, ...calibrationNotes(calibration, isOwn, allowed, needs)].join(" "));
  byId("risk-command").hidden = isOwn && isKnown;
  byId("risk-command").replaceChildren(
    whatToDo(isKnown, isOwn, needs),
    element("code", {}, `snap6d calibrate ${name}`),
  );
}

/** Ends before the command. */
function whatToDo(isKnown, isOwn, needs) {
  if (isOwn) return "Allow more, or calibrate again after more work, on the server: ";
  const by = `by this dataset’s own work, ${count(needs, "submitted registration")} at least, on the server: `;
  return isKnown ? `To calibrate it ${by}` : `Allow more, or calibrate it ${by}`;
}

/** Why a calibration of the dataset's own has no say, where it has one. */
function calibrationNotes(calibration, isOwn, allowed, needs) {
  if (!calibration || isOwn) return [];
  const has = `This dataset’s own is of ${count(calibration.registrations, "registration")}`;
  if (!calibration.is_current) return [`${has} with an earlier version: calibrate again.`];
  return [`${has}: it corrects the confidence, and is too small for ${allowed}, which takes ${needs}.`];
}

function askedFor(threshold) {
  return `That takes a confidence of ${threshold.toFixed(2)}, depth that agrees, and no other pose that fits as well.`;
}
