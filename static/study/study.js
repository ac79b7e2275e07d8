/** One study: its participants and how far they are, their links, and its end. */

import { del, get, post } from "../api.js";
import { byId, element, icon, setText } from "../dom.js";

const REFRESH_MS = 10_000;

export async function showStudy(id, message) {
  const url = `/api/studies/${id}`;
  let study = null;

  byId("close-study").addEventListener("click", close);
  await refresh();
  byId("study").hidden = false;
  setInterval(() => refresh().catch(message.problem), REFRESH_MS);

  async function refresh() {
    draw(await get(url));
  }

  function draw(received) {
    study = received;
    const { name, state, seed, plan, is_simulated: simulated, participants } = study;
    document.title = `${name} · Studies · Snap6D`;
    setText(byId("crumb-study"), name);
    byId("crumb-study").hidden = false;
    setText(byId("study-name"), name);
    setText(byId("study-state"), state);
    byId("study-simulated").hidden = !simulated;
    byId("report").href = `/report/${id}`;
    byId("close-study").hidden = state !== "open";
    const each = plan.tasks.length * plan.modes.length * plan.conditions.length;
    setText(byId("study-about"), `${plan.conditions.join(", ")} · ${plan.modes.join(", ")} · ${each} tasks each · seed ${seed}`);
    byId("invite").replaceChildren(...(state === "open" ? Object.entries(plan.groups).map(inviteButton) : []));
    byId("participants").replaceChildren(...participants.map(row));
    byId("no-participants").hidden = participants.length > 0;
  }

  function inviteButton([group, size]) {
    const here = study.participants.filter((one) => one.group === group && !one.withdrawn_at).length;
    const props = { type: "button", className: "button", disabled: here >= size };
    const button = element("button", props, icon("add"), `Invite: ${group} (${here} of ${size})`);
    button.addEventListener("click", () => tried(async () => showLink(await post(`${url}/participants`, { group }), group)));
    return button;
  }

  function row(one) {
    const { code, group, done, total, answers, is_simulated: simulated } = one;
    const bar = element("progress", { className: "human", max: total || 1, value: done, "aria-label": `Progress of ${code}` });
    const progress = total ? [bar, `${done} of ${total}`] : ["erased"];
    const said = Object.entries(answers ?? {}).map(([question, answer]) => `${question} ${answer}`);
    return element(
      "tr",
      {},
      element("td", {}, element("strong", {}, code)),
      element("td", {}, simulated ? `${group}, simulated` : group),
      element("td", {}, ...progress),
      element("td", {}, stateOf(one)),
      element("td", {}, said.join(" · ")),
      element("td", {}, element("div", { className: "actions" }, ...actions(one))),
    );
  }

  function actions(one) {
    const path = `${url}/participants/${one.id}`;
    const renew = ["New link", () => tried(async () => showLink(await post(`${path}/link`), one.group))];
    const withdraw = ["Withdraw…", () => askFirst(`Withdraw ${one.code}?`, "Their data are left out from now on, and their link no longer works. This cannot be taken back.", "Withdraw", () => post(`${path}/withdraw`))];
    const erase = ["Erase…", () => askFirst(`Erase the data of ${one.code}?`, "All that they did and answered is deleted for good, log included; that they were there stays.", "Erase", () => del(path))];
    const open = study.state === "open" && !one.withdrawn_at;
    const shown = [open && renew, !one.withdrawn_at && withdraw, one.total > 0 && erase].filter(Boolean);
    return shown.map(([label, run]) => {
      const button = element("button", { type: "button", className: "button quiet", "aria-label": `${label} ${one.code}` }, label);
      button.addEventListener("click", run);
      return button;
    });
  }

  function close() {
    askFirst("Close the study?", "Nobody can join it or go on with it any more; the data stay. This cannot be taken back.", "Close it", () => post(`${url}/close`));
  }

  function showLink({ code, link }, group) {
    const copy = element("button", { type: "button", className: "button" }, "Copy");
    copy.addEventListener("click", () => copyText(link, copy));
    byId("link-list").append(element("li", {}, element("strong", {}, code), group, element("code", {}, link), copy));
    byId("links").hidden = false;
  }

  function askFirst(title, text, yes, run) {
    const dialog = byId("sure");
    setText(byId("sure-title"), title);
    setText(byId("sure-text"), text);
    setText(byId("sure-yes"), yes);
    dialog.returnValue = "no";
    dialog.onclose = () => dialog.returnValue === "yes" && tried(run);
    dialog.showModal();
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

function stateOf({ withdrawn_at: withdrawn, finished_at: finished, consented_at: consented, done }) {
  const [name, text] = withdrawn
    ? ["skipped", "withdrawn"]
    : finished
      ? ["submitted", "finished"]
      : consented || done
        ? ["in_progress", "under way"]
        : ["open", "invited"];
  return element("span", { className: "state" }, icon(name), text);
}

/** The clipboard is closed to pages served over plain http: there the link is selected instead. */
async function copyText(text, button) {
  try {
    await navigator.clipboard.writeText(text);
    setText(button, "Copied");
  } catch {
    getSelection().selectAllChildren(button.previousElementSibling);
    setText(button, "Selected: copy it");
  }
}
