/** Taking part in a study: from the link, screen by screen, to the tasks and back, until the thanks. */

import { ApiError, get, onSignedOut, post, whoIsSignedIn } from "../shared/api.js";
import { byId, element, setText } from "../shared/dom.js";
import { messageArea } from "../shared/message.js";

const MODES = { accurate: "As accurately as you can", quick: "As quickly as you can" };
const TOOLS = {
  manual: "The handles of the object alone; there is no machine that helps.",
  snap: "The handles, and Snap (Space): roughly in place, the machine fits the object to its points.",
  "paper snap":
    "The handles, and Snap (Space): roughly in place, the machine fits the object to its points in some seconds.",
  auto:
    "The handles, and Snap (Space). After each move the machine looks by itself, too, and takes over where it is " +
    "confident; you may take that back.",
  "three points":
    "The handles, Snap (Space), and Three points (T): click points on the object and the same ones in the scene.",
  "click-to-place":
    "The handles, Snap (Space), and Place (P, or a double click): the object goes where you click.",
  "live snap": "The handles, Snap (Space), and Live (V): a ghost shows where a snap would land; Y takes it.",
  "find it":
    "The handles, Snap (Space), and Find (F): the machine shows where the object may be; Y takes one.",
};
const CLOCK = { quick: "A clock runs while the task is open.", accurate: "No clock is shown." };
const LINK_NEEDED =
  "Please open the link that was given to you: it leads to your study, as often as you like.";

/** What goes into a screen before it is shown. */
const FILL = {
  consent: () => setText(byId("consent-text"), place.consent),
  questions: () => byId("question-list").replaceChildren(...place.questions.map(questionField)),
  break: () => setText(byId("break-text"), `${place.done} of ${place.total} tasks are done.`),
  instructions: fillInstructions,
  task: fillTask,
  thanks: () => setText(byId("thanks-text"), `All ${place.total} tasks are done. You may close this page.`),
};

const message = messageArea(byId("message"));
let place = null; // as the server tells it
let screens = []; // that are still to be shown

onSignedOut(() => Promise.reject(new ApiError(401, LINK_NEEDED)));
for (const button of document.querySelectorAll("[data-on]")) button.addEventListener("click", showNext);
byId("consent").addEventListener("submit", (event) => send(event, () => post("/api/participation/consent")));
byId("questions").addEventListener("submit", (event) => send(event, sendAnswers));
byId("withdraw").addEventListener("click", () => byId("withdraw-dialog").showModal());
byId("withdraw-dialog").addEventListener("close", () => {
  if (byId("withdraw-dialog").returnValue === "withdraw") withdraw().catch(message.problem);
});
window.addEventListener("pageshow", ({ persisted }) => persisted && location.reload()); // "back" from a task

window.addEventListener("hashchange", () =>
  signInByLink().then((signedIn) => signedIn && location.reload(), refuse),
);

try {
  await signInByLink();
  await open();
} catch (error) {
  refuse(error);
}

function refuse(error) {
  byId("opening").hidden = true;
  setText(byId("no-entry-text"), error.message);
  showScreen("no-entry");
}

/**
 * Whether the address held a link's secret, which signs in; a link pasted into this tab does not load the page again.
 * The secret must not stay in the address, from where it would reach the history.
 */
async function signInByLink() {
  const token = decodeURIComponent(location.hash.slice(1));
  if (!token) return false;
  history.replaceState(null, "", location.pathname + location.search);
  await post("/api/sign-in/study", { token });
  return true;
}

async function open() {
  if ((await whoIsSignedIn()) === null) throw new Error(LINK_NEEDED);
  show(await get("/api/participation"));
}

function show(received) {
  place = received;
  screens = [...place.screens];
  const goesOn = new URLSearchParams(location.search).has("go-on") && screens[0] === "task";
  if (goesOn) {
    location.replace(taskUrl());
    return;
  }
  byId("opening").hidden = true;
  setText(byId("study"), place.study);
  setText(byId("code"), place.code);
  byId("code").hidden = false;
  byId("simulated").hidden = !place.is_simulated;
  byId("progress-row").hidden = false;
  byId("progress").max = place.total;
  byId("progress").value = place.done;
  setText(byId("progress-text"), `${place.done} of ${place.total} tasks done`);
  showScreen(screens[0]);
}

function showNext() {
  screens.shift();
  if (screens[0] === "task") location.assign(taskUrl());
  else showScreen(screens[0]);
}

function showScreen(name) {
  FILL[name]?.();
  for (const screen of document.querySelectorAll(".screen")) screen.hidden = screen.id !== name;
  byId("leaving").hidden = name === "withdrawn" || name === "no-entry";
  byId("leaving-text").hidden = name === "thanks";
  const heading = byId(name).querySelector("h1");
  heading.tabIndex = -1;
  heading.focus();
}

function fillInstructions() {
  const { mode, condition, instructions } = place.task;
  setText(byId("instructions-what"), whatComes());
  setText(byId("instructions-title"), MODES[mode]);
  setText(byId("instructions-text"), instructions);
  setText(byId("instructions-tools"), TOOLS[condition]);
}

function fillTask() {
  const { object, scene, mode } = place.task;
  setText(byId("task-what"), whatComes());
  setText(byId("task-title"), `${object}, ${scene}`);
  setText(byId("task-text"), `${MODES[mode]}. ${CLOCK[mode]}`);
  byId("task-start").href = taskUrl();
}

function taskUrl() {
  return `/label/${place.task.id}`;
}

function whatComes() {
  return place.task.is_practice
    ? "Practice, which does not count"
    : `Task ${place.done + 1} of ${place.total}`;
}

function questionField({ text, choices, optional }) {
  const required = !optional;
  const asked = [text, " ", element("small", {}, required ? "required" : "optional")];
  if (choices.length === 0) {
    const input = element("input", { name: text, required, maxLength: 1000, autocomplete: "off" });
    return element("label", { className: "field" }, element("span", {}, ...asked), input);
  }
  const options = choices.map((choice) =>
    element("label", {}, element("input", { type: "radio", name: text, value: choice, required }), choice),
  );
  return element("fieldset", { className: "choices" }, element("legend", {}, ...asked), ...options);
}

function sendAnswers() {
  const answers = /** @type {Record<string, string>} */ (Object.fromEntries(new FormData(byId("questions"))));
  return post("/api/participation/answers", { answers });
}

async function send(event, request) {
  event.preventDefault();
  message.clear();
  try {
    show(await request());
  } catch (error) {
    message.problem(error);
  }
}

async function withdraw() {
  await post("/api/participation/withdraw");
  setText(byId("withdrawn-code"), place.code);
  byId("progress-row").hidden = true;
  showScreen("withdrawn");
}
