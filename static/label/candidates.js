/** Poses to choose from, as pictures: where the machine found the object, or what fits the depth alike. */

import { del, get } from "../shared/api.js";
import { byId, setText } from "../shared/dom.js";
import { sharedDrawing } from "../shared/drawing/outline.js";
import { product } from "../shared/drawing/pose.js";
import { candidateCard, drawCard } from "./candidate_card.js";

const LEAST_WEIGHT = 0.05; // of a mode that is worth a look
const MOST_FOUND = 5; // that are worth one
const SAME = 1e-9; // metres, and entries of a rotation

/**
 * A part of the labelling page.
 *
 * @param {LabelPage} page
 * @returns {Part}
 */
export function candidatesPart(page) {
  let frames = [];
  let drawing = null; // promised
  /** @type {any} */
  let source = null; // {kind, id, url, symmetries}
  let cards = [];
  let chosen = -1; // the one that is looked at
  let sending = false;
  byId("candidate-previous").addEventListener("click", () => step(-1));
  byId("candidate-next").addEventListener("click", () => step(+1));
  byId("candidate-take").addEventListener("click", accept);
  byId("candidates-leave").addEventListener("click", leave);

  function open(_task, scene, object) {
    frames = scene.frames;
    drawing = sharedDrawing(object.outline_mesh_url);
  }

  function draw(registration) {
    const newest = sourceOf(registration);
    if (newest?.id !== source?.id || newest?.symmetries !== source?.symmetries) {
      if (newest && newest.id === source?.id) leave();
      source = newest;
      show([]);
      if (source) load(source).catch(page.message.problem);
    }
    if (!sending) mark(cards.findIndex((card) => isSame(card.T_world_object, registration.preview)));
  }

  async function load(wanted) {
    const [{ mesh, drawOn }, answer] = await Promise.all([drawing, get(wanted.url)]);
    if (wanted !== source || isOutdated(wanted, answer)) return;
    const { frame_id: frameId, poses } = posesOf(wanted, answer);
    const frame = frames.find(({ id }) => id === frameId);
    const withWorld = poses.map((one) => ({
      ...one,
      T_world_object: product(frame.T_world_camera, one.T_camera_object),
    }));
    show(withWorld.map((one, index) => candidateCard(one, index, frame, { choose, take })));
    setText(byId("candidates-title"), titleOf(wanted, poses.length));
    byId("candidates").hidden = wanted.kind === "mode" && poses.length < 2;
    for (const card of cards) drawCard(card, { mesh, drawOn, blend: wanted.kind === "mode" ? 0.5 : 0 });
    const { preview } = page.registration();
    if (preview) mark(cards.findIndex((card) => isSame(card.T_world_object, preview)));
    else if (wanted.kind === "proposal" && cards.length) choose(0);
  }

  function show(newCards) {
    cards = newCards;
    byId("candidates").hidden = true;
    byId("candidate-list").replaceChildren(...cards.map(({ item }) => item));
    for (const id of ["candidate-previous", "candidate-next", "candidate-take"])
      byId(id).hidden = cards.length === 0;
    mark(-1);
  }

  function mark(index) {
    chosen = index;
    byId("candidate-take").disabled = chosen < 0;
    for (const [i, { button }] of cards.entries()) button.setAttribute("aria-pressed", i === chosen);
  }

  /** Looks at a candidate; -1 at none. The newest choice wins, and answers never overtake each other. */
  async function choose(index) {
    mark(index);
    if (index >= 0) cards[index].item.scrollIntoView({ block: "nearest", inline: "nearest" });
    if (sending) return;
    sending = true;
    try {
      let sent;
      do {
        sent = chosen;
        await page.put("preview", { T_world_object: cards[sent]?.T_world_object ?? null });
      } while (sent !== chosen);
    } catch (error) {
      page.message.problem(error);
    } finally {
      sending = false;
    }
  }

  function step(by) {
    if (cards.length < 2 || !page.canMove()) return;
    byId("candidates").hidden = false;
    const from = Math.max(chosen, 0); // of modes the first is where the object is
    choose((from + by + cards.length) % cards.length);
  }

  async function take(index) {
    if (!page.canMove()) return;
    const isPresent = source.kind === "mode" && index === 0;
    if (isPresent) {
      choose(-1);
      if (page.registration().offer) page.act("offer-accept");
      return;
    }
    const body = {
      T_world_object: cards[index].T_world_object,
      technique: source.kind,
      stems_from: source.id,
    };
    page.message.clear();
    await page.put("pose", body).catch(page.message.problem);
  }

  /** True if there was something to take. */
  function accept() {
    if (chosen < 0) return false;
    take(chosen);
    return true;
  }

  /** True if there was something to leave; modes come back with a step to one of them. */
  function leave() {
    if (byId("candidates").hidden) return false;
    byId("candidates").hidden = true;
    if (chosen >= 0) choose(-1); // also after a choice that is still on its way
    if (source.kind === "proposal") del(source.url).catch(page.message.problem);
    return true;
  }

  const bindings = [
    {
      keys: ["["],
      does: "Look at the candidate before; Y takes it",
      run: () => step(-1),
      repeats: true,
      tool: "snap",
    },
    {
      keys: ["]"],
      does: "Look at the next candidate; Y takes it",
      run: () => step(+1),
      repeats: true,
      tool: "snap",
    },
  ];
  return { title: "The machine", bindings, open, draw, accept, leave };
}

/** Where the poses to choose from come from now; null where there are none. */
function sourceOf({ state, search, offer, estimate_snap_id: snapId, symmetries_version: symmetries }) {
  if (state !== "open") return null;
  if (search?.state === "done") return { kind: "proposal", id: search.id, url: `/api/searches/${search.id}` };
  const id = offer?.snap_id ?? snapId;
  return id ? { kind: "mode", id, url: `/api/snaps/${id}`, symmetries } : null;
}

/** Whether the object had other symmetries when it was snapped: what was told apart then may be one pose now. */
function isOutdated({ symmetries }, { estimate }) {
  const then = estimate?.symmetries_version ?? null; // null: an older version did not keep it
  return then !== null && then !== symmetries;
}

function posesOf({ kind }, { candidates, frame_id: frameId, estimate }) {
  if (kind === "proposal") return { frame_id: frameId, poses: candidates.slice(0, MOST_FOUND) };
  const likely = estimate.hypotheses.filter(({ weight }) => weight >= LEAST_WEIGHT);
  const poses = likely.map((one) => ({ ...one, chance: one.weight })); // one of them it is
  return { frame_id: estimate.frame_id, poses };
}

function titleOf({ kind }, count) {
  if (kind === "mode") return `The depth fits ${count} poses. Which is it?`;
  if (count === 0) return "Nothing like it was found in this frame. Try another one, or place it by hand.";
  return count === 1 ? "The machine found it here." : `The machine found ${count} poses. Which is it?`;
}

function isSame(A, B) {
  return B !== null && A.every((row, i) => row.every((value, j) => Math.abs(value - B[i][j]) < SAME));
}
