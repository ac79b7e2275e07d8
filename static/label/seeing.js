/** Seeing whether the pose is right: how depth agrees with it, and what the 3-D view shows or puts away. */

import { byId, setText } from "../dom.js";
import { drawsFinely, rememberLayers, rememberedLayers } from "./fineness.js";

const AT_FIRST = { cloud: true, mesh: true, fine: true, agreement: false };

/** A part of the labelling page. */
export function seeingPart(page) {
  const buttons = [...document.querySelectorAll("[data-layer]")];
  let isChanging = false;
  const wanted = () => {
    const remembered = { ...AT_FIRST, fine: drawsFinely(), ...rememberedLayers() };
    return { ...remembered, agreement: remembered.agreement && page.has("agreement") };
  };
  for (const button of buttons) button.addEventListener("click", () => toggle(button.dataset.layer));

  function draw({ agreement, layers }, before) {
    drawAgreement(agreement);
    for (const button of buttons) button.setAttribute("aria-pressed", layers[button.dataset.layer]);
    byId("verdicts").hidden = !layers.agreement;
    const fresh = !before || (isSame(layers, AT_FIRST) && !isSame(before.layers, AT_FIRST)); // page or server came up
    if (fresh && !isSame(layers, wanted())) change(wanted());
  }

  function toggle(name) {
    if (!page.isConnected() || isChanging) return;
    const { layers } = page.registration();
    const changed = { ...layers, [name]: !layers[name] };
    rememberLayers(changed);
    change(changed);
  }

  async function change(layers) {
    if (isChanging) return;
    isChanging = true;
    await page.put("layers", layers).catch(page.message.problem);
    isChanging = false;
  }

  const bindings = [
    { keys: ["R"], does: "Colour the object by how depth agrees, or not", run: () => toggle("agreement"), tool: "agreement" },
    { keys: ["B"], does: "Hide the cloud, and show it again", run: () => toggle("cloud") },
    { keys: ["Shift+F"], does: "All measured points, or few, which are drawn sooner", run: () => toggle("fine") },
    { keys: ["M"], does: "Hide the mesh, and show it again", run: () => toggle("mesh") },
  ];
  return { title: "The view", bindings, draw };
}

const isSame = (one, other) => Object.keys(AT_FIRST).every((name) => one[name] === other[name]);
const percent = (share) => `${Math.round(100 * share)} %`;

function drawAgreement(agreement) {
  const { inlier_share: share = null, median_residual: residual = null } = agreement ?? {};
  setText(byId("agreement-share"), share === null ? "–" : percent(share));
  setText(byId("agreement-residual"), residual === null ? "" : `· ${(1000 * residual).toFixed(1)} mm`);
  for (const row of document.querySelectorAll("[data-verdict]")) {
    const { verdict } = row.dataset;
    setText(row.querySelector("output"), agreement ? percent(agreement[verdict]) : "–");
  }
}
