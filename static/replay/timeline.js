/** The time line: signs of the events in lanes, idle stretches, and the curve above them. */

import { byId, element, svg } from "../shared/dom.js";
import { curvePaths, curveTicks } from "./curve.js";
import { LANE_HEIGHT, laneTop, SIGNS } from "./signs.js";

const CURVE_HEIGHT = 64;
const HEIGHT = CURVE_HEIGHT + 3 * LANE_HEIGHT;
const LEAST_LABELLED = 46; // pixels of an idle stretch that has room for its name

/**
 * Draws a trace; returns `place(seconds)`, where a time lies, as a share of the width.
 *
 * @param {Rest["TraceOut"]} trace
 * @param {(seconds: number) => void} onTime
 */
export function drawTimeLine(trace, onTime) {
  const plot = byId("plot");
  const lanes = byId("lanes");
  const share = (seconds) => (trace.seconds > 0 ? seconds / trace.seconds : 0);
  const present = SIGNS.filter(({ kinds }) => trace.events.some(({ kind }) => kinds.includes(kind)));
  byId("legend").replaceChildren(...present.map(legendEntry), ...(trace.idle.length ? [idleEntry()] : []));

  function draw() {
    const width = plot.clientWidth;
    const at = (seconds) => Number((share(seconds) * width).toFixed(1));
    lanes.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
    lanes.replaceChildren(
      ...trace.idle.flatMap((stretch) => idleStretch(at(stretch.start), at(stretch.end), stretch)),
      ...curveTicks(trace.curve, CURVE_HEIGHT).flatMap(({ value, y }) => [
        svg("path", { class: "grid", d: `M0 ${y}H${width}` }),
        svg("text", { class: "tick", x: 2, y: y - 2 }, value),
      ]),
      ...curvePaths(trace.curve, at, CURVE_HEIGHT).map((d, i) =>
        svg("path", { class: ["curve", "curve dashed"][i], d }),
      ),
      ...present.map((sign) => signPath(sign, trace.events, at)),
    );
  }

  let held = false;
  const timeAt = ({ clientX }) =>
    ((clientX - plot.getBoundingClientRect().left) / plot.clientWidth) * trace.seconds;
  plot.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    held = true;
    plot.setPointerCapture(event.pointerId);
    onTime(timeAt(event));
    event.preventDefault();
  });
  plot.addEventListener("pointermove", (event) => held && onTime(timeAt(event)));
  plot.addEventListener("lostpointercapture", () => (held = false));
  new ResizeObserver(draw).observe(plot);
  return share;
}

/** All events of a sign in one path, so that ten thousand of them are drawn as quickly as ten. */
function signPath({ kinds, lane, path, look }, events, at) {
  const shown = events.filter(({ kind }) => kinds.includes(kind));
  const d = shown.map(({ start, end }) => path(at(start), at(end))).join("");
  const top = CURVE_HEIGHT + laneTop(lane);
  return svg("path", { class: `sign ${lane} ${look}`, d, transform: `translate(0 ${top})` });
}

function idleStretch(from, to, { start, end }) {
  const box = svg("rect", { class: "idle", x: from, y: 0, width: to - from, height: HEIGHT });
  if (to - from < LEAST_LABELLED) return [box];
  const name = `idle ${Math.round(end - start)} s`;
  return [
    box,
    svg(
      "text",
      {
        class: "idle-name",
        x: (from + to) / 2,
        y: CURVE_HEIGHT + laneTop("machine") + 14,
        "text-anchor": "middle",
      },
      name,
    ),
  ];
}

function legendEntry({ name, lane, path, look }) {
  const isBar = path(0, 20).includes("h20");
  const sign = svg("path", { class: `sign ${lane} ${look}`, d: isBar ? path(1, 15) : path(8, 8) });
  return element("li", {}, svg("svg", { width: 16, height: LANE_HEIGHT, "aria-hidden": true }, sign), name);
}

function idleEntry() {
  const box = svg("rect", { class: "idle", x: 1, y: 4, width: 14, height: 12 });
  return element("li", {}, svg("svg", { width: 16, height: LANE_HEIGHT, "aria-hidden": true }, box), "idle");
}
