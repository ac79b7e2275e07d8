/** Setting a study up: a form, and beside it what it amounts to and the order that it leads to. */

import { getAll, getDescription, post } from "../shared/api.js";
import { byId, element, setText } from "../shared/dom.js";
import { count } from "../shared/format.js";
import { messageArea } from "../shared/message.js";
import { amountsOf, noteOn } from "./amounts.js";
import { goToFirst, placedProblem, showProblems } from "./field-problems.js";
import { showOrders } from "./orders.js";
import { groupsOf, questionsOf } from "./plan-text.js";
import { thingList } from "./things.js";

const PAUSE_MS = 250; // after the last key, before the order is asked for

/** What the words mean, beside each; a word that is not here stands alone. */
const MEANINGS = {
  accurate: "as accurately as they can; no clock is shown",
  quick: "as quickly as they can; a clock is shown",
  manual: "the handles alone, no machine: the baseline",
  snap: "the handles, and Snap when they ask for it",
  "paper snap": "the same by the paper’s filter, 5 to 10 s a snap",
  auto: "Snap, and the machine takes over where it is sure",
  "three points": "Snap, and placing by three pairs of points",
  "click-to-place": "Snap, and placing by a click",
  "live snap": "Snap, and a ghost where it would land",
  "find it": "Snap, and the machine looks by itself",
};

/**
 * Shows the form once all of it is there.
 *
 * @param {Message} pageMessage
 */
export async function showSetUp(pageMessage) {
  const form = byId("set-up");
  const message = messageArea(byId("preview-message"));
  const things = thingList(() => changed("things"));
  const touched = new Set(); // fields that were filled in: nobody is blamed for those that were not yet
  let fromServer = ["", ""]; // what it last said of the form as it is: the field, and the sentence
  let waiting = null;
  let newest = 0;

  const [modes, datasets, studies] = await Promise.all([
    fillFromDescription(),
    getAll("/api/datasets"),
    getAll("/api/studies"),
  ]);
  const taken = new Set(studies.map(({ name }) => name));
  byId("seed").value = String(crypto.getRandomValues(new Uint32Array(1))[0] % 100000);
  byId("dataset").replaceChildren(...datasets.map(({ id, name }) => new Option(name, String(id))));
  byId("no-datasets").hidden = datasets.length > 0;
  byId("choose-things").hidden = datasets.length === 0;
  if (datasets.length) await loadThings();
  byId("dataset").addEventListener("change", () => loadThings().catch(pageMessage.problem));
  form.addEventListener("input", ({ target }) => {
    const input = /** @type {HTMLInputElement} */ (target);
    if (!input.closest("[data-search]")) changed(fieldOf(input));
  });
  form.addEventListener("submit", create);
  setText(byId("crumb-study"), "New study");
  byId("crumb-study").hidden = false;
  form.hidden = false;
  await preview();

  async function loadThings() {
    const wanted = byId("dataset").value;
    byId("things").setAttribute("aria-busy", "true");
    try {
      const tasks = await getAll("/api/tasks", { dataset_id: wanted });
      if (wanted === byId("dataset").value) things.show(tasks);
    } finally {
      if (wanted === byId("dataset").value) byId("things").removeAttribute("aria-busy");
    }
  }

  function plan() {
    return {
      modes: ticked("modes"),
      conditions: ticked("conditions"),
      groups: Object.fromEntries(groupsOf(byId("groups").value)),
      tasks: things.used("task"),
      practice: things.used("practice"),
      consent: byId("consent").value,
      instructions: Object.fromEntries(modes.map((mode) => [mode, byId(`instructions-${mode}`).value])),
      questions: questionsOf(byId("questions").value),
      break_after: Number(byId("break-after").value),
    };
  }

  function changed(field) {
    touched.add(field);
    fromServer = ["", ""];
    newest += 1; // whatever is still to be answered is out of date
    clearTimeout(waiting);
    waiting = setTimeout(preview, PAUSE_MS);
    showWhatIsWrong();
  }

  /** By field, what is wrong with the form as it is. */
  function problems() {
    const own = { ...lacking(plan()), ...wrongText(taken) };
    return Object.fromEntries(
      Object.entries({ [fromServer[0]]: fromServer[1], ...own }).filter(([, text]) => text),
    );
  }

  function showWhatIsWrong() {
    const told = Object.entries(problems()).filter(([field]) => touched.has(field));
    showProblems(form, Object.fromEntries(told));
    setText(byId("questions-read"), readBack(questionsOf(byId("questions").value)));
  }

  /** Of several answers only the one to the form as it is now counts; until it comes the last one stays, paler. */
  async function preview() {
    const mine = ++newest;
    message.clear();
    const wanted = plan();
    const { name: _, ...ofPlan } = problems();
    const lacks = Object.values(ofPlan)[0];
    if (lacks) {
      showAmounts(lacks);
      return;
    }
    byId("preview").setAttribute("aria-busy", "true");
    try {
      const answer = await post("/api/studies/preview", { plan: wanted, seed: Number(byId("seed").value) });
      if (mine === newest) showAmounts(null, wanted, answer);
    } catch (error) {
      if (mine === newest) refused(error);
    }
  }

  function showAmounts(lacks, wanted, answer) {
    const notes = lacks ? { time: lacks, order: "" } : noteOn(wanted, answer);
    byId("preview").removeAttribute("aria-busy");
    byId("amounts").replaceChildren(...(lacks ? [] : amountsOf(wanted, answer)));
    byId("preview-orders").replaceChildren(...(lacks ? [] : [showOrders(answer.orders, things.nameOf)]));
    setText(byId("preview-summary"), notes.time);
    setText(byId("order-note"), notes.order);
    byId("order").hidden = Boolean(lacks);
  }

  /** What the server says is shown at the field, or where it is about none, below the order. */
  function refused(error) {
    const [field, text] = placedProblem(error.message);
    if (!byId(`${field}-problem`)) {
      showAmounts("The order is shown once this is mended.");
      message.show(text, "problem");
      return;
    }
    fromServer = [field, text];
    touched.add(field);
    showWhatIsWrong();
    showAmounts(text);
  }

  async function create(event) {
    event.preventDefault();
    const wrong = problems();
    for (const field of Object.keys(wrong)) touched.add(field);
    showWhatIsWrong();
    if (Object.keys(wrong).length) {
      goToFirst(form);
      return;
    }
    byId("create").disabled = true;
    try {
      const body = { name: byId("name").value, plan: plan(), seed: Number(byId("seed").value) };
      const { id } = await post("/api/studies", body);
      location.assign(`/studies?study=${id}`);
    } catch (error) {
      refused(error);
      byId("create").disabled = false;
    }
  }
}

/** What there is to choose, and what a plan is where nothing is chosen, the server says; returns the modes. */
async function fillFromDescription() {
  const { components } = await getDescription();
  const plan = components.schemas.StudyPlan.properties;
  for (const name of ["modes", "conditions"]) {
    const { items, default: first } = plan[name];
    byId(`${name}-ticks`).replaceChildren(
      ...items.enum.map((value) => tick(name, value, first.includes(value))),
    );
  }
  const modes = plan.modes.items.enum;
  for (const mode of modes) byId(`instructions-${mode}`).value = plan.instructions.default[mode];
  byId("groups").value = Object.entries(plan.groups.default)
    .map((group) => group.join(" "))
    .join(", ");
  byId("break-after").value = plan.break_after.default;
  return modes;
}

function tick(group, name, checked) {
  const box = element("input", { type: "checkbox", name: group, value: name, checked });
  const meaning = element("small", {}, MEANINGS[name] ?? "");
  return element("label", {}, box, element("span", {}, name, " ", meaning));
}

function ticked(group) {
  const boxes = [...byId(`${group}-ticks`).querySelectorAll("input")];
  return boxes.filter(({ checked }) => checked).map(({ value }) => value);
}

/** The field that an input belongs to: its own, or the group of ticks. */
const fieldOf = (input) => input.name || input.id;

/** By field, what a plan still lacks. */
function lacking({ modes, conditions, tasks }) {
  return {
    things: tasks.length ? "" : "Choose at least one object that counts: then times and order stand here.",
    modes: modes.length ? "" : "Tick at least one mode.",
    conditions: conditions.length ? "" : "Tick at least one condition.",
  };
}

/** By field, what cannot be read as it is written. */
function wrongText(taken) {
  const name = byId("name").value.trim();
  const whole = (id, words) => (byId(id).validity.valid ? "" : `Write a whole number ${words}.`);
  return {
    name: name
      ? taken.has(name)
        ? `There already is a study “${name}”: choose another name.`
        : ""
      : "Give the study a name.",
    groups: wrongGroups(groupsOf(byId("groups").value)),
    "break-after": whole("break-after", "from 0 to 1000; 0 means no breaks"),
    seed: whole("seed", "from 0 on"),
  };
}

function wrongGroups(groups) {
  if (!groups.length || groups.some(([name, size]) => !name || size < 1)) {
    return "Write each group with its number of participants, such as “novice 8, expert 8”.";
  }
  const names = groups.map(([name]) => name);
  const twice = names.find((name, index) => names.indexOf(name) < index);
  return twice ? `The group “${twice}” is there twice: write each once.` : "";
}

/** How the questions were understood. */
function readBack(questions) {
  if (!questions.length) return "";
  const free = questions.filter(({ choices }) => !choices.length).length;
  const optional = questions.filter((question) => question.optional).length;
  return `Read as ${count(questions.length, "question")}: ${questions.length - free} with choices, ${free} free; ${optional} optional.`;
}
