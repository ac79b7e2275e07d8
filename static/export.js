/** Export: choose a dataset, start the job, see the gate's verdict, download. */

import { get, getAll, post } from "./shared/api.js";
import { byId, element, icon, setText } from "./shared/dom.js";
import { count, fileSize } from "./shared/format.js";
import { messageArea } from "./shared/message.js";
import { openPage } from "./shared/page.js";

const POLL_MS = 500;
const STATES = {
  queued: "Queued",
  running: "Running",
  done: "Passed the checks",
  failed: "Nothing was exported",
};
const ENDED = new Set(["done", "failed"]);

const message = messageArea(byId("message"));
/** @type {Rest["DatasetOut"][]} */
let datasets = [];
/** @type {number | null} */
let followed = null;
/** @type {Rest["ExportOut"]} */
let shown;

byId("dataset").addEventListener("change", showContents);
byId("export-form").addEventListener("submit", start);
byId("copy").addEventListener("click", copyCurl);
byId("without").addEventListener("click", exportRest);

await openPage(message, async ({ role }) => {
  if (role === "admin") await showPage();
  else message.show("Exports are made by administrators. Ask one of them for this dataset.");
});

async function showPage() {
  const [formats, found] = await Promise.all([get("/api/exports/formats"), getAll("/api/datasets")]);
  datasets = found;
  if (datasets.length === 0) {
    message.show("There is nothing to export yet. Import a dataset first, on the home page.");
    return;
  }
  byId("format").replaceChildren(...formats.map(({ name, title }) => new Option(title, name)));
  byId("dataset").replaceChildren(...datasets.map(({ name, id }) => new Option(name, String(id))));
  const asked = new URLSearchParams(location.search).get("dataset_id");
  if (asked && datasets.some(({ id }) => String(id) === asked)) byId("dataset").value = asked;
  byId("export-form").hidden = false;
  showContents();
  const jobs = await showEarlier();
  const unfinished = jobs.find(({ state }) => !ENDED.has(state));
  if (unfinished) follow(unfinished.id).catch(message.problem);
}

function chosen() {
  return datasets[byId("dataset").selectedIndex];
}

function showContents() {
  const { id, scenes, objects, tasks, tasks_submitted: submitted, suggestions_open: open } = chosen();
  const figures = { "poses submitted": submitted, "tasks still open": tasks - submitted, scenes, objects };
  byId("undecided").hidden = !open;
  for (const link of [byId("objects"), ...byId("undecided").querySelectorAll("a")])
    link.href = `/objects?dataset_id=${id}`;
  setText(byId("undecided-count"), count(open, "object"));
  byId("contents").replaceChildren(
    ...Object.entries(figures).map(([name, number]) =>
      element("div", {}, element("dt", {}, name), element("dd", {}, number.toLocaleString("en"))),
    ),
  );
  byId("nothing").hidden = submitted > 0;
  byId("start").disabled = submitted === 0;
}

async function start(event) {
  event.preventDefault();
  await begin({ dataset_id: chosen().id, format: byId("format").value });
}

/** Asks for the export that is shown again, without what it failed on. */
async function exportRest() {
  const { dataset_id, format, scene_ids, without, failures } = shown;
  const failed = failures.map(({ registration_id: id }) => id);
  await begin({ dataset_id, format, scene_ids, without: [...without, ...failed] });
}

async function begin(request) {
  message.clear();
  byId("start").disabled = true;
  try {
    const { id } = await post("/api/exports", request);
    await follow(id);
  } catch (error) {
    message.problem(error);
  }
  showContents();
}

/** Shows a job until it has ended, or until another one is followed. */
async function follow(id) {
  followed = id;
  while (followed === id) {
    const job = await get(`/api/exports/${id}`);
    showJob(job);
    if (ENDED.has(job.state)) {
      await showEarlier();
      return;
    }
    await new Promise((resolve) => setTimeout(resolve, POLL_MS));
  }
}

function showJob(job) {
  const ended = ENDED.has(job.state);
  shown = job;
  byId("job").hidden = false;
  setText(byId("job-title"), jobName(job));
  if (byId("job-state").dataset.state !== job.state) byId("job-state").replaceChildren(...verdict(job));
  byId("job-state").dataset.state = job.state;
  byId("progress").hidden = ended;
  byId("progress").value = job.progress;
  setText(byId("job-message"), job.message ?? "");
  byId("failures-area").hidden = job.failures.length === 0;
  byId("failures").replaceChildren(...job.failures.map(failureItem));
  byId("result").hidden = job.state !== "done";
  if (job.state === "done") showDownload(job);
}

/** One object: where it was put, whose it is, why it did not pass, and a link to it. */
function failureItem({ registration_id, object, operator, scene, image_id, reason, picture_url }) {
  const picture = element("img", { src: picture_url, alt: `${object} as it was put`, loading: "lazy" });
  const link = element("a", { href: `/replay/${registration_id}` }, object);
  const place = element("small", { className: "muted" }, `${scene}, image ${image_id} · by ${operator}`);
  return element("li", {}, picture, element("div", {}, link, element("p", {}, reason), place));
}

function showDownload(job) {
  const url = new URL(job.download_url, location.origin);
  byId("download").href = url.pathname;
  setText(byId("download-label"), `Download${job.bytes ? ` · ${fileSize(job.bytes)}` : ""}`);
  setText(byId("curl"), `curl --fail -OJ -H "Authorization: Bearer $SNAP6D_TOKEN" ${url}`);
}

async function copyCurl() {
  try {
    await navigator.clipboard.writeText(byId("curl").textContent);
    setText(byId("copy-label"), "Copied");
  } catch {
    // The clipboard is closed to pages served over plain http: select the line instead.
    getSelection()?.selectAllChildren(byId("curl"));
    setText(byId("copy-label"), "Selected: copy it");
  }
}

/** Shows all exports, the newest first, and returns them. */
async function showEarlier() {
  const jobs = (await getAll("/api/exports")).sort((one, other) => other.id - one.id);
  byId("earlier").hidden = jobs.length === 0;
  byId("exports").replaceChildren(...jobs.map(jobRow));
  return jobs;
}

function jobRow(job) {
  const verdictCell = element("td", {}, ...verdict(job));
  if (job.message) verdictCell.append(element("small", {}, job.message));
  const link = job.download_url ? element("a", { href: job.download_url, download: "" }, "Download") : "";
  return element(
    "tr",
    {},
    element("td", {}, jobName(job)),
    verdictCell,
    element("td", { className: "number" }, job.bytes ? fileSize(job.bytes) : ""),
    element("td", {}, link),
  );
}

function verdict({ state }) {
  const icons = { queued: "open", running: "in_progress", done: "check", failed: "alert" };
  return [icon(icons[state]), ` ${STATES[state]}`];
}

function jobName({ dataset_name: name, format }) {
  return `${name} · ${format.toUpperCase()}`;
}
