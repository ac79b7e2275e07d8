/**
 * The replay of a registration: joins the time line, the clock, the 3-D view, the image and the keys.
 *
 * The page is the clock; what there was to see at a time is asked of the server, which moves the 3-D view with it.
 */

import { get, post, put } from "../shared/api.js";
import { drawAssessment } from "../shared/assessment.js";
import { byId, setText } from "../shared/dom.js";
import { imagePart } from "../shared/drawing/image.js";
import { setUpHelp } from "../shared/help.js";
import { keyBindings, releaseFocusAfterPointer } from "../shared/keys.js";
import { messageArea } from "../shared/message.js";
import { drawPoser } from "../shared/posed-by.js";
import { openView } from "../shared/view.js";
import { clockText, playbackClock } from "./clock.js";
import { eventList } from "./events.js";
import { presenter } from "./presenter.js";
import { drawTimeLine } from "./timeline.js";

const DEGREES = 180 / Math.PI;
const id = Number(location.pathname.split("/").filter(Boolean).at(-1));
const url = /** @type {const} */ (`/api/registrations/${id}`);
const message = messageArea(byId("message"));
let chosenFrame = null; // by the reviewer; null shows the operator's

const image = imagePart({
  message,
  isConnected: () => true,
  showFrame: async (frame) => {
    chosenFrame = frame.id;
    follow(false);
  },
});
const present = presenter(showAt, drawMoment, (error) => {
  clock?.pause();
  message.problem(error, { label: "Load again", run: () => location.reload() });
});
let clock = null;

try {
  await open();
} catch (error) {
  byId("opening").hidden = true;
  setText(byId("closed-text"), error.message);
  byId("closed").hidden = false;
}

async function open() {
  const [trace, { view_url: viewUrl }] = await Promise.all([get(`${url}/trace`), post(`${url}/replay`)]);
  const task = await get(`/api/tasks/${trace.task_id}`);
  const [scene, object] = await Promise.all([
    get(`/api/scenes/${task.scene.id}`),
    get(`/api/objects/${task.object.id}`),
  ]);
  showNames(task, trace);
  image.open(task, scene, object);
  const events = eventList(trace, (seconds) => clock.put(seconds));
  const place = drawTimeLine(trace, (seconds) => clock.put(seconds));
  clock = playbackClock({
    duration: trace.seconds,
    idle: trace.idle,
    onPlaying: showPlaying,
    onTime: showTime,
  });
  setUpControls(trace, events, viewUrl);
  clock.put(trace.first_sight);

  function showTime(seconds) {
    const text = clockText(seconds);
    setText(byId("time"), text);
    byId("playhead").style.left = `${100 * place(seconds)}%`;
    byId("scrub").value = seconds;
    byId("scrub").setAttribute("aria-valuetext", `${text} of ${clockText(trace.seconds)}`);
    events.mark(seconds);
    present(seconds);
  }
}

function showNames(
  { dataset, scene, name },
  { operator, condition, state, is_simulated: simulated, seconds },
) {
  document.title = `Replay of ${name} · Snap6D`;
  setText(byId("crumb-dataset"), dataset.name);
  setText(byId("crumb-scene"), scene.label);
  setText(byId("crumb-object"), name);
  setText(byId("title"), `Replay of ${name}`);
  setText(byId("crumb-operator"), `Replay of ${operator.name}`);
  byId("crumb-dataset").href = `/?dataset_id=${dataset.id}`;
  byId("crumb-scene").href = `/?dataset_id=${dataset.id}&scene_id=${scene.id}`;
  setText(byId("about"), `${condition} · ${state}${simulated ? " · simulated" : ""}`);
  setText(byId("duration"), clockText(seconds));
}

function setUpControls(trace, events, viewUrl) {
  const goTo = (event) => event && clock.put(event.end);
  const goBack = () => goTo(events.previous(clock.seconds()));
  const goOn = () => goTo(events.next(clock.seconds()));
  const bindings = [
    { keys: ["Space"], does: "Play and pause", run: clock.toggle },
    { keys: [","], does: "Previous event", run: goBack, repeats: true },
    { keys: ["."], does: "Next event", run: goOn, repeats: true },
    ...image.bindings.filter(({ keys }) => keys.every((key) => key !== "," && key !== ".")),
    { keys: ["?"], does: "Show these keys", run: () => openHelp() },
  ];
  const openHelp = setUpHelp(bindings.map((binding) => ({ group: "Replay", ...binding })));
  const attachKeys = keyBindings(bindings);
  attachKeys(window);
  releaseFocusAfterPointer(document);

  byId("play").addEventListener("click", clock.toggle);
  byId("event-previous").addEventListener("click", goBack);
  byId("event-next").addEventListener("click", goOn);
  byId("speed").addEventListener("change", () => clock.setSpeed(Number(byId("speed").value)));
  byId("skip-idle").addEventListener("change", () => clock.setSkipsIdle(byId("skip-idle").checked));
  byId("follow").addEventListener("change", () => follow(byId("follow").checked));
  byId("scrub").max = trace.seconds;
  byId("scrub").addEventListener("input", () => clock.put(byId("scrub").valueAsNumber));

  openView(viewUrl, (viewWindow) => {
    attachKeys(viewWindow);
    for (const kind of ["pointerdown", "wheel"]) {
      viewWindow.addEventListener(kind, () => follow(false), { capture: true, passive: true });
    }
    clock.put(clock.seconds());
  });
}

/** Looks as the operator did, at their frame, or lets the reviewer look freely. */
function follow(wanted) {
  byId("follow").checked = wanted;
  if (wanted) chosenFrame = null;
  clock.put(clock.seconds());
}

function showAt(seconds) {
  return put(`${url}/replay`, { seconds, follow: byId("follow").checked, frame_id: chosenFrame });
}

function drawMoment(moment) {
  image.draw(moment);
  const { ghost, confidence, assessment, posed_by: poser, to_last: toLast } = moment;
  byId("ghost").hidden = ghost === null;
  if (ghost) {
    setText(
      byId("ghost-text"),
      `${ghost.on_offer ? "Offered by the machine" : "Put here by the machine"}, confidence `,
    );
    setText(byId("ghost-confidence"), ghost.confidence.toFixed(2));
    drawAssessment(byId("ghost-assessment"), ghost.assessment);
  }
  const numbers = [
    `${(1000 * toLast.translation).toFixed(1)} mm`,
    `${(DEGREES * toLast.rotation).toFixed(1)}°`,
  ];
  setText(byId("distance"), `${numbers.join(" · ")} to the end`);
  const thought = assessment ? `, ${assessment.verdict}` : "";
  drawPoser(byId("source"), poser, confidence === null ? "" : `, ${confidence.toFixed(2)}${thought}`);
}

function showPlaying(isPlaying) {
  byId("play-icon").setAttribute("href", `/static/icons.svg#${isPlaying ? "pause" : "play"}`);
  setText(byId("play-text"), isPlaying ? "Pause" : "Play");
}
