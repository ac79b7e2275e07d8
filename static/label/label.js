/**
 * The labelling page: joins the 3-D view, the panel, the keys and the server.
 *
 * What else there is on the page are parts: makers that take the `page` below and return any of
 * `bindings` (keys, which the help shows under `title`), `open(task, scene, object)`, called once,
 * `draw(registration, before)`, called for every new state, `attach(window)`, called for each document of the
 * 3-D view, `leave()`, which leaves a mode and tells whether there was one to leave, and `accept()`, which
 * takes what it shows, likewise.
 */

import { del, get, post, put } from "../shared/api.js";
import { byId, setText } from "../shared/dom.js";
import { imagePart } from "../shared/drawing/image.js";
import { setUpHelp } from "../shared/help.js";
import { keyBindings, releaseFocusAfterPointer } from "../shared/keys.js";
import { messageArea } from "../shared/message.js";
import { closeView, focusView, openView } from "../shared/view.js";
import { candidatesPart } from "./candidates.js";
import { connectionPart } from "./connection.js";
import { copyPart } from "./copy.js";
import { endingPart } from "./ending.js";
import { findPart } from "./find.js";
import { guidePart } from "./guide.js";
import { machinePart } from "./machine.js";
import { methodPart } from "./method.js";
import { goToNext } from "./next.js";
import { numbersPart } from "./numbers.js";
import { othersPart } from "./others.js";
import { drawPanel, possible } from "./panel.js";
import { placePart } from "./place.js";
import { precisionPart } from "./precision.js";
import { seeingPart } from "./seeing.js";
import { signInAgainHere } from "./sign-in-again.js";
import { snapFramesPart } from "./snap-frames.js";
import { followRegistration } from "./stream.js";
import { submissionPart } from "./submission.js";
import { swapPart } from "./swap.js";
import { thingsPart } from "./things.js";
import { threePointsPart } from "./three-points.js";
import { showTools } from "./tools.js";
import { trialPart } from "./trial.js";
import { uncertaintyPart } from "./uncertainty.js";
import { viewRingPart } from "./view-ring.js";
import { viewsPart } from "./views.js";
import { isSnapping, waitingPart } from "./waiting.js";

const BEHIND_NOTICE = ".stage > :not(#closed), #strip, .side, #help";
const taskId = location.pathname.split("/").filter(Boolean).at(-1);
const message = messageArea(byId("message"));
const pending = new Set();
/** @type {Rest["Me"]} */
let me;
/** @type {Rest["TaskOut"]} */
let task;
/** @type {Registration | null} */
let registration = null;
/** @type {Set<string>} */
let tools = new Set();
/** @type {Promise<Rest["SnapDetail"]> | null} */
let snapRequest = null;
let steps = Promise.resolve(); // undo and redo under way, one after the other
let stepsLeft = 0;
let connected = true;

/** @type {LabelPage} */
const page = {
  message,
  path,
  me: () => me,
  isTrial: () => me?.role === "participant",
  has: (tool) => tools.has(tool),
  registration: () => /** @type {Registration} */ (registration),
  isConnected: () => connected,
  put: (action, body) => change(put(/** @type {any} */ (path(action)), body)),
  post: (action, body) => change(post(/** @type {any} */ (path(action)), body)),
  canMove: () => connected && registration?.state === "open" && !registration.dragging,
  act,
  showFrame: (frame) => page.put("frame", { frame_id: frame.id }),
  leaveMode,
};
const submission = submissionPart(page);
/** @type {Part[]} */
const PARTS = [
  submission,
  endingPart(page),
  connectionPart(page),
  othersPart(),
  guidePart(page),
  imagePart(page),
  swapPart(),
  machinePart(page),
  methodPart(page),
  snapFramesPart(page),
  numbersPart(page),
  placePart(page),
  threePointsPart(page),
  copyPart(page),
  precisionPart(page),
  thingsPart(page),
  findPart(page),
  candidatesPart(page),
  uncertaintyPart(page),
  seeingPart(page),
  viewsPart(page),
  viewRingPart(),
  trialPart(page),
  waitingPart(),
];

const ACTIONS = {
  snap: requestSnap,
  cancel: async () => del(`/api/snaps/${page.registration().snap?.id ?? (await snapRequest)?.id}`),
  undo: () => page.post("undo"),
  redo: () => page.post("redo"),
  reset: () => page.post("reset"),
  submit: submission.submit,
  reopen: () => page.post("reopen"),
  "offer-accept": () => page.post("accept"),
  "offer-dismiss": () => page.post("dismiss"),
};

const grouped = (group, bindings) => bindings.map((binding) => ({ group, ...binding }));
const BINDINGS = [
  ...grouped("The task", [
    { keys: ["Mod+Z"], does: "Undo", run: (_key, isHeld) => step("undo", isHeld), repeats: true },
    {
      keys: ["Mod+Shift+Z", "Mod+Y"],
      does: "Redo",
      run: (_key, isHeld) => step("redo", isHeld),
      repeats: true,
    },
    { keys: ["Shift+R"], does: "Back to the start pose", run: () => act("reset") },
    {
      keys: ["Escape"],
      does: "Leave a mode, or cancel the snap; or back to the 3-D view",
      run: leaveOrCancel,
    },
    { keys: ["Enter"], does: "Submit; once more: go to the next task", run: submitOrGoOn },
    { keys: ["?"], does: "Show these keys", run: () => openHelp() },
  ]),
  ...grouped("The machine", [
    { keys: ["Space"], does: "Snap", run: () => act("snap"), tool: "snap" },
    { keys: ["Y"], does: "Accept the machine's offer, ghost or candidate", run: accept, tool: "snap" },
    { keys: ["N"], does: "Dismiss the machine's offer", run: () => act("offer-dismiss"), tool: "snap" },
  ]),
  ...PARTS.flatMap(({ title = "More", bindings = [] }) => grouped(title, bindings)),
];
const openHelp = setUpHelp(BINDINGS);
const attachKeys = keyBindings(BINDINGS, ({ tool }) => !tool || tools.has(tool));

attachKeys(window);
releaseFocusAfterPointer(document);
for (const id of Object.keys(ACTIONS)) {
  const run = ["undo", "redo"].includes(id) ? step : act;
  byId(id).addEventListener("click", () => run(id));
}
byId("closed-retry").addEventListener("click", () => location.reload());

try {
  await openTask();
} catch (error) {
  showRefused(error);
}

async function openTask() {
  const start = () => post(`/api/tasks/${taskId}/registration`);
  me = await signInAgainHere(focusView);
  const [started, described] = await Promise.all([start(), get(`/api/tasks/${taskId}`)]);
  task = described;
  tools = new Set(started.tools);
  showTools(tools);
  showTask();
  openView(started.view_url, attachToView);
  const [scene, object] = await Promise.all([
    get(`/api/scenes/${task.scene.id}`),
    get(`/api/objects/${task.object.id}`),
  ]);
  for (const part of PARTS) part.open?.(task, scene, object);
  show(started);
  followRegistration(started.id, {
    resume: start,
    onRegistration: showFromServer,
    onLost: showLost,
    onTakenOver: showTakenOver,
    onRefused: showRefused,
  });
  if (!page.isTrial()) await showDatasetProgress().catch(message.problem);
}

function showTask() {
  const { dataset, scene, name } = task;
  document.title = `${name} · ${scene.label} · Snap6D`;
  setText(byId("crumb-dataset"), dataset.name);
  setText(byId("crumb-scene"), scene.label);
  setText(byId("crumb-object"), name);
  setText(byId("title"), name);
  byId("crumb-dataset").href = `/?dataset_id=${dataset.id}`;
  byId("crumb-scene").href = `/?dataset_id=${dataset.id}&scene_id=${scene.id}`;
  if (!page.isTrial()) byId("crumb-object").href = `/objects/${task.object.id}`;
}

async function showDatasetProgress() {
  const { tasks, tasks_submitted: submitted } = await get(`/api/datasets/${task.dataset.id}`);
  setText(byId("dataset-progress"), `${submitted} of ${tasks} submitted`);
}

function showFromServer(received) {
  connected = true;
  byId("connection").hidden = true;
  show(received);
}

/** Shows the answer to a change at once: what is pressed next goes by it. */
async function change(request) {
  const answer = await request;
  show(answer);
  return answer;
}

/** Draws a state of the registration, the only place where it changes; one that was overtaken is left out. */
function show(/** @type {Registration} */ received) {
  const before = registration;
  if (before && received.revision < before.revision) return;
  registration = received;
  drawPanel(received, connected);
  for (const part of PARTS) part.draw?.(received, before);
  reportSnap(before?.snap, received.snap);
  const { message: problem, symmetries_version: version } = received;
  if (before && version !== before.symmetries_version && !page.isTrial()) {
    message.show("The object's symmetries were changed: the next snap goes by the new ones.");
  }
  if (problem && problem !== before?.message) message.show(problem, "problem");
  if (before && received.state !== before.state && !page.isTrial())
    showDatasetProgress().catch(message.problem);
}

function reportSnap(before, snap) {
  if (!snap || (before?.id === snap.id && before?.state === snap.state)) return;
  if (snap.asked_by === "machine") return;
  if (snap.state !== "failed") message.clear();
  else message.show(snap.message, "problem", { label: "Try again", run: () => act("snap") });
}

async function act(name) {
  if (!pending.has(name) && possible(registration, connected)[name]) await perform(name);
}

/**
 * Undo or redo. Each press counts, in its turn, while a key that is held goes on only after each answer.
 * Whether there is anything to undo the server knows first: it says so where there is not.
 */
function step(name, isHeld = false) {
  if ((isHeld && stepsLeft > 0) || !connected || registration?.state !== "open") return;
  stepsLeft += 1;
  steps = steps.then(() => perform(name)).finally(() => (stepsLeft -= 1));
}

async function perform(name) {
  pending.add(name);
  try {
    message.clear();
    await ACTIONS[name]();
  } catch (error) {
    message.problem(error);
  } finally {
    pending.delete(name);
  }
}

/** Shows the snap as queued at once, so that it can be cancelled before the server has answered. */
async function requestSnap() {
  const { method, snap: before } = page.registration();
  snapRequest = post(path("snaps"), {});
  show({
    ...page.registration(),
    snap: { id: null, asked_by: "human", state: "queued", progress: 0, message: null, method, frames: null },
  });
  try {
    await snapRequest;
  } catch (error) {
    show({ ...page.registration(), snap: before });
    throw error;
  }
}

function attachToView(viewWindow) {
  attachKeys(viewWindow);
  for (const part of PARTS) part.attach?.(viewWindow);
}

/** True if there was a mode to leave. */
function leaveMode() {
  return PARTS.some((part) => part.leave?.());
}

/** With nothing to leave or to cancel the keys go back to the view, where some of them steer its camera. */
function leaveOrCancel() {
  if (leaveMode()) return;
  if (possible(registration, connected).cancel) act("cancel");
  else focusView();
}

function accept() {
  if (!PARTS.some((part) => part.accept?.())) act("offer-accept");
}

function submitOrGoOn() {
  if (registration && registration.state !== "open") goToNext();
  else if (registration && isSnapping(registration)) {
    message.show("A snap is running: wait for it, or cancel it (Esc), and submit then.");
  } else act("submit");
}

function showLost() {
  connected = false;
  byId("connection").hidden = false;
  drawPanel(page.registration(), connected);
  focusView();
}

function showTakenOver() {
  connected = false;
  drawPanel(page.registration(), connected);
  closeView();
  const text = "It goes on there, with everything you did here. This tab no longer follows it.";
  showClosed("This task was opened in another tab", text, "Continue here instead");
}

function showRefused(error) {
  showClosed("This task cannot be opened", error.message, "Try again");
}

function showClosed(title, text, retry) {
  byId("opening").hidden = true;
  byId("connection").hidden = true;
  byId("offer").hidden = true;
  byId("note").hidden = true;
  setText(byId("closed-title"), title);
  setText(byId("closed-text"), text);
  setText(byId("closed-retry"), retry);
  byId("closed").hidden = false;
  for (const node of document.querySelectorAll(BEHIND_NOTICE)) node.inert = true;
  byId("closed-retry").focus();
}

/**
 * The address of something about the registration.
 *
 * @template {string} Action
 * @param {Action} action
 * @returns {ActionPath<Action>}
 */
function path(action) {
  return `/api/registrations/${page.registration().id}/${action}`;
}
