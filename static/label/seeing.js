/** Seeing whether the pose is right: how depth agrees with it, and what the 3-D view shows or puts away. */

import { byId, setText } from "../shared/dom.js";
import { drawsFinely, rememberedLayers, rememberLayers } from "../shared/fineness.js";

const AT_FIRST = { cloud: true, mesh: true, texture: true, fine: true, agreement: false };

/**
 * A part of the labelling page.
 *
 * @param {LabelPage} page
 * @returns {Part}
 */
export function seeingPart(page) {
  const buttons = [...document.querySelectorAll("[data-layer]")];
  let asked = null; // the layers that the server is on the way to be told
  const wanted = () => {
    const remembered = { ...AT_FIRST, fine: drawsFinely(), ...rememberedLayers() };
    return { ...remembered, agreement: remembered.agreement && page.has("agreement") };
  };
  for (const button of buttons) button.addEventListener("click", () => toggle(button.dataset.layer));

  function draw({ agreement, layers, has_texture: hasTexture }, before) {
    drawAgreement(agreement);
    for (const button of buttons) if (button.dataset.layer === "texture") button.hidden = !hasTexture;
    for (const button of buttons) button.setAttribute("aria-pressed", layers[button.dataset.layer ?? ""]);
    byId("verdicts").hidden = !layers.agreement;
    const fresh = !before || (isSame(layers, AT_FIRST) && !isSame(before.layers, AT_FIRST)); // page or server came up
    if (fresh && !isSame(layers, wanted())) change(wanted());
  }

  function toggle(name) {
    if (!page.isConnected()) return;
    const layers = asked ?? page.registration().layers;
    const changed = { ...layers, [name]: !layers[name] };
    rememberLayers(changed);
    change(changed);
  }

  /** The newest wish wins, and answers never overtake each other. */
  async function change(layers) {
    const isSending = asked !== null;
    asked = layers;
    if (isSending) return;
    try {
      let sent;
      do {
        sent = asked;
        await page.put("layers", sent);
      } while (sent !== asked);
    } catch (error) {
      page.message.problem(error);
    } finally {
      asked = null;
    }
  }

  const bindings = [
    {
      keys: ["R"],
      does: "Colour the object by how depth agrees, or not",
      run: () => toggle("agreement"),
      tool: "agreement",
    },
    { keys: ["B"], does: "Hide the cloud, and show it again", run: () => toggle("cloud") },
    {
      keys: ["Shift+F"],
      does: "All measured points, or few, which are drawn sooner",
      run: () => toggle("fine"),
    },
    { keys: ["M"], does: "Hide the mesh, and show it again", run: () => toggle("mesh") },
    { keys: ["Shift+M"], does: "The mesh in its own colours, or in orange", run: () => toggle("texture") },
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
    const text = agreement && verdict ? percent(agreement[verdict]) : "–";
    for (const output of row.querySelectorAll("output")) setText(output, text);
  }
}
