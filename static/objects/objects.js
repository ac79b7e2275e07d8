/** Objects: a list of a dataset's, and one of them turning, with its symmetries and what a lead decides of them. */

import { get, getAll, put } from "../shared/api.js";
import { byId, element, icon, setText } from "../shared/dom.js";
import { objectDrawing } from "../shared/drawing/textured.js";
import { messageArea } from "../shared/message.js";
import { openPage } from "../shared/page.js";
import { axisText, groupText, isAlong, residualText } from "./axes.js";
import { axisEditor, residualOf } from "./editor.js";
import { stageOf } from "./stage.js";

const message = messageArea(byId("message"));
const objectId = location.pathname.split("/").filter(Boolean)[1] ?? null;
let isLead = false;
let item = null; // the object, as the server tells it
let stage = null;
let editor = null;
let played = null; // the button of what is played
let deciding = false;

byId("accept-all").addEventListener("click", () => decide(withSuggestions(item.suggestions)));
byId("none").addEventListener("click", () => decide([]));
byId("undo").addEventListener("click", () => change({ restore: item.undo_version }));
byId("add").addEventListener("click", () => editor.open());
byId("stop").addEventListener("click", () => play(null, null));
byId("spin").addEventListener("click", () => spin(byId("spin").getAttribute("aria-pressed") !== "true"));

await openPage(message, async ({ role }) => {
  isLead = role === "admin";
  if (objectId === null) await goToOne();
  else await showPage();
});

/** `/objects?dataset_id=` leads to the first object that waits for a decision, or else the first. */
async function goToOne() {
  const objects = await getAll("/api/objects", {
    dataset_id: new URLSearchParams(location.search).get("dataset_id"),
  });
  const first = objects.find(({ suggestions_open: open }) => open) ?? objects[0];
  if (first) location.replace(`/objects/${first.id}`);
  else message.show("There are no objects yet. An administrator has to import a dataset first.");
}

async function showPage() {
  item = await get(`/api/objects/${objectId}`);
  const [dataset, drawing] = await Promise.all([
    get(`/api/datasets/${item.dataset_id}`),
    objectDrawing(item),
    showList(),
  ]);
  showNames(dataset);
  const places = { canvas: byId("mesh"), rest: byId("rest"), axes: byId("axes") };
  const told = {
    onPoint: (point) => editor?.onPoint(point),
    onTurned: showTurned,
    onGrasp: () => spin(false),
  };
  stage = stageOf(places, drawing, item, told);
  if (stage === null)
    message.show("Without WebGL 2 the object cannot be shown here; its numbers hold all the same.");
  editor = axisEditor({
    item: () => item,
    save: decide,
    onChange: drawStage,
    play,
    onProblem: message.problem,
  });
  for (const node of document.querySelectorAll(".lead-only")) node.hidden = !isLead;
  byId("asks-lead").hidden = isLead;
  draw();
  spin(!matchMedia("(prefers-reduced-motion: reduce)").matches);
}

function showNames({ id, name }) {
  document.title = `${item.name} · Snap6D`;
  setText(byId("name"), item.name);
  setText(byId("crumb-object"), item.name);
  setText(byId("crumb-dataset"), name);
  byId("crumb-dataset").href = `/?dataset_id=${id}`;
  const size = item.size.map((metres) => (1000 * metres).toFixed(1)).join(" × ");
  const facts = {
    "x × y × z": `${size} mm`,
    diameter: `${(1000 * item.diameter).toFixed(1)} mm`,
    "BOP id": `${item.obj_id}`,
  };
  byId("facts").replaceChildren(
    ...Object.entries(facts).map(([what, value]) =>
      element("div", {}, element("dt", {}, what), element("dd", {}, value)),
    ),
  );
}

async function showList() {
  const objects = await getAll("/api/objects", { dataset_id: item.dataset_id });
  byId("list").replaceChildren(...objects.map(listEntry));
  const open = objects.find(({ id, suggestions_open: isOpen }) => isOpen && id !== item.id);
  byId("next-open").hidden = !open || !isLead;
  if (open) byId("next-open").href = `/objects/${open.id}`;
}

function listEntry({ id, name, symmetries, suggestions_open: isOpen }) {
  const state = isOpen
    ? element("small", { className: "is-open" }, icon("machine"), "suggested")
    : element("small", {}, groupText(symmetries));
  const link = element("a", { href: `/objects/${id}` }, element("span", {}, name), state);
  if (id === item.id) link.setAttribute("aria-current", "page");
  return element("li", {}, link);
}

function draw() {
  drawSuggestions();
  drawPresent();
  drawStage();
  drawVersions().catch(message.problem);
}

function drawSuggestions() {
  const { suggestions, diameter } = item;
  byId("suggested").hidden = !suggestions?.length;
  if (!suggestions?.length) return;
  setText(byId("suggested-text"), suggestedText());
  byId("suggestions").replaceChildren(
    ...suggestions.map((axis, index) => {
      const isThere = item.axes.some((one) => isAlong(one, axis) && one.fold === axis.fold);
      const accept = element("button", { type: "button", className: "button" }, "Accept");
      accept.addEventListener("click", () => decide(withSuggestions([axis])));
      return axisRow({
        number: `${index + 1}`,
        axis,
        note: residualText(axis.residual, diameter),
        actions: isThere
          ? [element("span", { className: "accepted" }, icon("check"), "accepted")]
          : isLead
            ? [accept]
            : [],
      });
    }),
  );
  byId("accept-all").disabled = suggestions.every((axis) => item.axes.some((one) => isAlong(one, axis)));
}

function suggestedText() {
  const how =
    "Play each: does the object look as before after every turn? " +
    "99 % of its surface misses itself by less than is said, in millimetres and percent of the diameter. " +
    "Colours were not looked at.";
  return item.suggestions_open ? `Found on the mesh; nobody has decided yet. ${how}` : how;
}

function drawPresent() {
  const { axes, symmetries, symmetries_version: version, suggestions } = item;
  setText(byId("version"), `version ${version}`);
  setText(
    byId("present-text"),
    axes.length
      ? `What snaps, errors and exports go by: ${groupText(symmetries)}.`
      : nothingText(suggestions),
  );
  byId("present").replaceChildren(...axes.map(presentRow));
  byId("undo").disabled = item.undo_version === null;
  byId("none").disabled = !axes.length && !item.suggestions_open;
}

function nothingText(suggestions) {
  if (item.suggestions_open) return "None, until somebody decides.";
  if (item.symmetries_version > 1) return "None, as was decided.";
  if (suggestions === null)
    return "None so far. The server looks into the mesh in the background: come back in a moment.";
  return "None, and none were found on the mesh.";
}

function presentRow(axis, index) {
  const note = element("small", {}, "measuring…");
  const known = item.suggestions?.find((one) => isAlong(one, axis) && one.fold === axis.fold);
  const tell = (residual) => setText(note, residualText(residual, item.diameter));
  if (known) tell(known.residual);
  else residualOf(item, axis).then(tell, () => setText(note, ""));
  const edit = element("button", { type: "button", className: "button quiet" }, "Change");
  const remove = element(
    "button",
    { type: "button", className: "button quiet square", title: "Remove" },
    icon("close"),
  );
  edit.setAttribute("aria-label", `Change axis ${letter(index)}`);
  remove.setAttribute("aria-label", `Remove axis ${letter(index)}`);
  edit.addEventListener("click", () => editor.open(index));
  remove.addEventListener("click", () => decide(item.axes.filter((one) => one !== axis)));
  return axisRow({ number: letter(index), axis, note, actions: isLead ? [edit, remove] : [] });
}

function axisRow({ number, axis, note, actions }) {
  const start = element(
    "button",
    { type: "button", className: "button square", title: "Play its turns" },
    icon("play"),
  );
  start.setAttribute("aria-label", `Play the turns of axis ${number}`);
  start.setAttribute("aria-pressed", "false");
  start.addEventListener("click", () => play(start === played ? null : start, axis));
  const text = element(
    "span",
    { className: "axis-text" },
    axisText(axis),
    typeof note === "string" ? element("small", {}, note) : note,
  );
  return element("li", {}, element("span", { className: "number" }, number), start, text, ...actions);
}

const letter = (index) => String.fromCharCode(65 + (index % 26)).repeat(1 + Math.floor(index / 26));

/** Those that the object has by now, and these; of two in one direction the new one. */
function withSuggestions(wanted) {
  const kept = item.axes.filter((axis) => !wanted.some((one) => isAlong(one, axis)));
  return [...kept, ...wanted];
}

function decide(axes) {
  return change({ axes: axes.map(({ axis, point, fold }) => ({ axis, point, fold })) });
}

/** One at a time; true where it was accepted. */
async function change(decision) {
  if (deciding) return false;
  deciding = true;
  message.clear();
  try {
    item = await put(`/api/objects/${objectId}/symmetries`, {
      ...decision,
      version: item.symmetries_version,
    });
    play(null, null);
    draw();
    await showList();
    return true;
  } catch (error) {
    const again = error.status === 409 ? { label: "Look at it", run: () => location.reload() } : null;
    message.problem(error, again);
    return false;
  } finally {
    deciding = false;
  }
}

function drawStage() {
  if (!stage) return;
  const suggestions = (item.suggestions ?? [])
    .map((axis, index) => ({ ...axis, label: `${index + 1}`, kind: "suggested" }))
    .filter((axis) => !item.axes.some((one) => isAlong(one, axis)));
  const present = item.axes.map((axis, index) => ({ ...axis, label: letter(index), kind: "present" }));
  const draft = editor.draft();
  const drafts = draft ? [{ ...draft, label: "new", kind: "draft" }] : [];
  stage.show([...suggestions, ...present, ...drafts], editor.picked());
}

/** Plays an axis; `button` is the one that was pressed for it, null stops. */
function play(button, axis) {
  stage?.stop();
  played?.setAttribute("aria-pressed", "false");
  played = button;
  if (!button || !stage) return;
  spin(false);
  button.setAttribute("aria-pressed", "true");
  stage.play(axis);
}

function showTurned(degrees) {
  byId("stop").hidden = degrees === null;
  document.querySelector(".stage")?.classList.toggle("playing", degrees !== null);
  const text = degrees === null ? "" : `turned by ${degrees.toFixed(0)}° · the line is its outline at rest`;
  setText(byId("caption"), text);
}

function spin(on) {
  byId("spin").setAttribute("aria-pressed", on);
  stage?.spin(on);
}

async function drawVersions() {
  const versions = await get(`/api/objects/${objectId}/symmetries`);
  byId("versions").replaceChildren(...versions.map(versionRow));
}

function versionRow({ version, axes, restores, user, utc }) {
  const when = new Date(utc).toLocaleString("en", { dateStyle: "medium", timeStyle: "short" });
  const what = axes.length ? axes.map(axisText).join("; ") : "none";
  const back = restores === null ? "" : ` (as in version ${restores})`;
  const restore = element("button", { type: "button", className: "button quiet" }, "Bring back");
  restore.setAttribute("aria-label", `Bring version ${version} back`);
  restore.addEventListener("click", () => change({ restore: version }));
  const isPresent = version === item.symmetries_version;
  const who = user ? user.name : "imported";
  return element(
    "li",
    {},
    element("span", {}, `${version} · ${what}${back}`, element("small", {}, `${who}, ${when}`)),
    isLead && !isPresent ? restore : null,
  );
}
