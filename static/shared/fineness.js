/** How finely the 3-D view is drawn: as the user chose, or as this browser can. */

const REMEMBERED = "snap6d.layers";
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;
const COARSE_RATIO = 0.5; // of the view's pixels to those of the screen, along each side

/** What the user chose to see in the view, {name: whether}; what was never chosen is not in it. */
export function rememberedLayers() {
  return JSON.parse(localStorage.getItem(REMEMBERED) ?? "{}");
}

/**
 * Keeps what the user chose, for this browser.
 *
 * @param {Rest["Layers"]} layers
 */
export function rememberLayers(layers) {
  localStorage.setItem(REMEMBERED, JSON.stringify(layers));
}

/** Whether the view shows all that was measured, as sharply as the screen: not where software has to draw it. */
export function drawsFinely() {
  return rememberedLayers().fine ?? !rendersInSoftware();
}

/** What to ask viser for in its address, so that it draws as finely as that. */
export function finenessQuery() {
  return drawsFinely() ? "" : `&fixedDpr=${COARSE_RATIO}`;
}

function rendersInSoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const info = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = gl && info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return SOFTWARE.test(name);
}
