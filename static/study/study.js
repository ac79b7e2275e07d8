/** One study: its participants and how far they are, their links, and its end. */

import { del, get, post } from "../shared/api.js";
import { byId, element, icon, setText } from "../shared/dom.js";
import { askFirst } from "./sure.js";

const REFRESH_MS = 10_000;
const CLOSE = {
  title: "Close the study?",
  text: "Nobody can join it or go on with it any more; the data stay. This cannot be taken back.",
  yes: "Close it",
};
const withdrawing = (code) => ({
  title: `Withdraw ${code}?`,
  text: "Their data are left out from now on, and their link no longer works. This cannot be taken back.",
  yes: "Withdraw",
});
const renewing = (code) => ({
  title: `A new link for ${code}?`,
  text: "The one before no longer works, and whoever is signed in by it is signed out. What they did stays.",
  yes: "New link",
});
const erasing = (code) => ({
  title: `Erase the data of ${code}?`,
  text: "All that they did and answered is deleted for good, log included; that they were there stays.",
  yes: "Erase",
});

/**
 * @param {string | null | undefined} id
 * @param {Message} message
 */
export async function showStudy(id, message) {
  const url = /** @type {const} */ (`/api/studies/${id}`);
  /** @type {Rest["StudyDetail"]} */
  let study;

  byId("close-study").addEventListener("click", () =>
    askFirst(CLOSE, () => tried(() => post(`${url}/close`))),
  );
  await refresh();
  byId("study").hidden = false;
  setInterval(() => refresh().catch(message.problem), REFRESH_MS);

  /** Draws only what has changed, so that nobody loses the button under their finger. */
  async function refresh() {
    const received = await get(url);
    if (JSON.stringify(received) === JSON.stringify(study)) return;
    study = received;
    drawStudy();
    byId("participants").replaceChildren(...study.participants.map(row));
    byId("no-participants").hidden = study.participants.length > 0;
  }

  function drawStudy() {
    const { name, state, seed, plan, is_simulated: simulated } = study;
    const { conditions, modes, tasks, groups, questions } = /** @type {Required<Rest["StudyPlan"]>} */ (plan);
    const isOpen = state === "open";
    document.title = `${name} · Studies · Snap6D`;
    setText(byId("crumb-study"), name);
    byId("crumb-study").hidden = false;
    setText(byId("study-name"), name);
    setText(byId("study-state"), state);
    byId("study-simulated").hidden = !simulated;
    byId("report").href = `/report/${id}`;
    byId("answers").href = `${url}/answers.csv`;
    byId("answers").hidden = questions.length === 0;
    byId("close-study").hidden = !isOpen;
    const each = `${tasks.length * modes.length * conditions.length} tasks each`;
    setText(byId("study-about"), [conditions.join(", "), modes.join(", "), each, `seed ${seed}`].join(" · "));
    byId("invite").replaceChildren(...(isOpen ? Object.entries(groups).map(inviteButton) : []));
  }

  function inviteButton([group, size]) {
    const here = study.participants.filter((one) => one.group === group && !one.withdrawn_at).length;
    const text = `Invite: ${group} (${here} of ${size})`;
    return button([icon("add"), text], "button", () => invite(group), here >= size);
  }

  const invite = (group) => tried(async () => showLink(await post(`${url}/participants`, { group }), group));

  function row(one) {
    const { code, group, done, total, answers, is_simulated: simulated } = one;
    const props = { className: "human", max: total || 1, value: done, "aria-label": `Progress of ${code}` };
    const said = Object.entries(answers ?? {}).flatMap(([question, answer]) => [
      element("dt", {}, question),
      element("dd", {}, answer ?? element("em", { className: "muted" }, "left empty")),
    ]);
    const cells = [
      [element("strong", {}, code)],
      [simulated ? `${group}, simulated` : group],
      total ? [element("progress", props), `${done} of ${total}`] : ["erased"],
      [stateOf(one)],
      said.length ? [element("dl", { className: "answers" }, ...said)] : [],
      [element("div", { className: "actions" }, ...actions(one))],
    ];
    return element("tr", {}, ...cells.map((content) => element("td", {}, ...content)));
  }

  function actions({ id: participant, code, group, total, withdrawn_at: withdrawn }) {
    const path = /** @type {const} */ (`${url}/participants/${participant}`);
    const newLink = async () => showLink(await post(`${path}/link`), group);
    const renew = () => askFirst(renewing(code), () => tried(newLink));
    const withdraw = () => askFirst(withdrawing(code), () => tried(() => post(`${path}/withdraw`)));
    const erase = () => askFirst(erasing(code), () => tried(() => del(path)));
    const all = [
      { isThere: study.state === "open" && !withdrawn, label: "New link…", run: renew },
      { isThere: !withdrawn, label: "Withdraw…", run: withdraw },
      { isThere: total > 0, label: "Erase…", run: erase },
    ];
    return all
      .filter(({ isThere }) => isThere)
      .map(({ label, run }) => button([label, hiddenText(` ${code}`)], "button quiet", run));
  }

  function showLink({ code, link }, group) {
    const copy = button(["Copy"], "button", () => copyText(link, copy));
    const parts = [element("strong", {}, code), group, element("code", {}, link), copy];
    byId("link-list").append(element("li", {}, ...parts));
    byId("links").hidden = false;
  }

  async function tried(run) {
    message.clear();
    try {
      await run();
      await refresh();
    } catch (error) {
      message.problem(error);
    }
  }
}

const hiddenText = (text) => element("span", { className: "visually-hidden" }, text);

function button(content, className, run, disabled = false) {
  const node = element("button", { type: "button", className, disabled }, ...content);
  node.addEventListener("click", run);
  return node;
}

function stateOf({ withdrawn_at: withdrawn, finished_at: finished, consented_at: consented, answers, done }) {
  let [name, text] = ["open", "invited"];
  if (withdrawn) [name, text] = ["skipped", "withdrawn"];
  else if (finished) [name, text] = ["submitted", "finished"];
  else if (consented || answers || done) [name, text] = ["in_progress", "under way"];
  return element("span", { className: "state" }, icon(name), text);
}

/** The clipboard is closed to pages served over plain http: there the link is selected instead. */
async function copyText(text, copy) {
  try {
    await navigator.clipboard.writeText(text);
    setText(copy, "Copied");
  } catch {
    getSelection()?.selectAllChildren(copy.previousElementSibling);
    setText(copy, "Selected: copy it");
  }
}
