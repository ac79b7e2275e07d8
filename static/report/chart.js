/**
 * One panel of curves: seconds to come within each margin. Hover or arrow keys read a point out, a click or Enter
 * opens the replay behind it.
 */

import { element, svg } from "../shared/dom.js";
import { count } from "../shared/format.js";
import { digits, secondsText, shareText, unitOf } from "./numbers.js";
import { BOX, HEIGHT, scalesOf, WIDTH } from "./scales.js";

const HINT = "Point at a curve, or move along it with the arrow keys; click or Enter opens a replay.";
let made = 0;

/**
 * Series are {name, hand, mode, points}, points {margin, seconds, low, high, operators, trials, share, id}; `compared`
 * are all that are to have the same scales.
 */
export function chart(title, error, series, compared) {
  const scales = scalesOf(compared, error);
  const mark = svg("circle", { class: "mark", r: 5 });
  mark.style.display = "none";
  const picture = svg(
    "svg",
    {
      viewBox: `0 0 ${WIDTH} ${HEIGHT}`,
      tabindex: 0,
      role: "application",
      "aria-roledescription": "chart",
      "aria-label": title,
    },
    ...axes(scales, error),
    ...series.map((one) => svg("path", { class: `share ${one.hand}`, d: areaPath(one.points, scales) })),
    ...series.map((one) =>
      svg("path", { class: `share-edge ${one.hand} ${one.mode}`, d: sharePath(one.points, scales) }),
    ),
    ...series.map((one) => svg("path", { class: `band ${one.hand}`, d: bandPath(one.points, scales) })),
    ...series.flatMap((one) => curve(one, scales)),
    mark,
  );
  made += 1;
  const readout = element("p", { className: "readout", role: "status", id: `readout-${made}` }, HINT);
  picture.setAttribute("aria-describedby", readout.id);
  let shown = null; // [series, point]

  function show(found) {
    shown = found;
    mark.style.display = found ? "" : "none";
    picture.classList.toggle("on-point", found !== null && found[1].id !== null);
    if (!found) return;
    const [one, point] = found;
    mark.setAttribute("cx", scales.x(point.margin));
    mark.setAttribute("cy", scales.y(point.seconds));
    mark.setAttribute("class", `mark ${one.hand}`);
    readout.textContent = pointText(one, point, error);
  }

  picture.addEventListener("pointermove", (event) => show(nearest(series, scales, place(picture, event))));
  picture.addEventListener("click", () => open(shown));
  picture.addEventListener("keydown", (event) => {
    if (event.key === "Enter") open(shown);
    else if (event.key.startsWith("Arrow")) show(stepped(series, shown, event.key));
    else return;
    event.preventDefault();
  });
  return element("figure", { className: "panel chart" }, element("h2", {}, title), picture, readout);
}

/** A line as the curves are drawn, with its name. */
export function legendEntry({ hand, mode, name }) {
  const children = [svg("path", { class: `line ${hand} ${mode}`, d: "M1 8H33" })];
  if (mode === "quick") children.push(svg("circle", { class: `dot ${hand}`, cx: 17, cy: 8, r: 3 }));
  return element("li", {}, svg("svg", { width: 34, height: 16, "aria-hidden": true }, ...children), name);
}

function pointText(one, { margin, seconds, low, high, operators, trials, share, id }, error) {
  const sure = low === null ? "" : ` (95 %: ${secondsText(low)} to ${secondsText(high)})`;
  const gap = error === "translation" ? " " : "";
  return (
    `${one.name}: within ${digits(margin)}${gap}${unitOf(error)} after ${secondsText(seconds)}${sure}; ` +
    `n = ${count(operators, "operator")}, ${count(trials, "trial")}; ${shareText(share)} remain. ` +
    (id === null ? "" : `Replay: registration ${id}.`)
  );
}

function open(found) {
  if (found && found[1].id !== null) location.assign(`/replay/${found[1].id}`);
}

/** Where the pointer is, in the units of the picture. */
function place(picture, { clientX, clientY }) {
  const box = picture.getBoundingClientRect();
  return { x: ((clientX - box.left) / box.width) * WIDTH, y: ((clientY - box.top) / box.height) * HEIGHT };
}

function nearest(series, scales, { x, y }) {
  let best = null;
  let least = Infinity;
  for (const one of series) {
    for (const point of reached(one)) {
      const distance = Math.hypot(4 * (scales.x(point.margin) - x), scales.y(point.seconds) - y);
      if (distance < least) [best, least] = [[one, point], distance];
    }
  }
  return best;
}

/** The point beside the shown one: left and right along the curve, up and down on another one. */
function stepped(series, shown, key) {
  const lines = series.filter((one) => reached(one).length > 0);
  if (lines.length === 0) return null;
  if (!shown) return [lines[0], reached(lines[0])[0]];
  const [one, point] = shown;
  const sideways = { ArrowLeft: -1, ArrowRight: 1 }[key] ?? 0;
  const turn = { ArrowUp: -1, ArrowDown: 1 }[key] ?? 0;
  const line = lines[(lines.indexOf(one) + turn + lines.length) % lines.length];
  const points = reached(line);
  const index = points.findIndex(({ margin }) => margin <= point.margin * 1.0001);
  const at = (index < 0 ? points.length - 1 : index) + sideways;
  return [line, points[Math.min(Math.max(at, 0), points.length - 1)]];
}

const reached = ({ points }) => points.filter(({ seconds }) => seconds !== null);

function curve(one, scales) {
  const points = reached(one);
  const d = points
    .map((point, i) => `${i ? "L" : "M"}${scales.x(point.margin)} ${scales.y(point.seconds)}`)
    .join("");
  const dots = one.mode === "quick" ? points.filter((_, i) => i % 4 === 0) : [];
  return [
    svg("path", { class: `line ${one.hand} ${one.mode}`, d }),
    ...dots.map((point) =>
      svg("circle", {
        class: `dot ${one.hand}`,
        cx: scales.x(point.margin),
        cy: scales.y(point.seconds),
        r: 3,
      }),
    ),
  ];
}

function sharePath(points, { x, share }) {
  return points.map((point, i) => `${i ? "L" : "M"}${x(point.margin)} ${share(point.share)}`).join("");
}

function areaPath(points, scales) {
  const { x } = scales;
  return `${sharePath(points, scales)}L${x(points.at(-1).margin)} ${BOX.bottom}L${x(points[0].margin)} ${BOX.bottom}Z`;
}

function bandPath(points, { x, y }) {
  const known = points.filter(({ low }) => low !== null);
  if (known.length === 0) return "";
  const side = (ordered, bound) => ordered.map((point) => `${x(point.margin)} ${y(point[bound])}`).join("L");
  return `M${side(known, "high")}L${side([...known].reverse(), "low")}Z`;
}

function axes(scales, error) {
  const text = (attributes, words) => svg("text", { class: "tick", ...attributes }, words);
  return [
    ...scales.seconds.flatMap((seconds) => [
      svg("path", { class: "grid", d: `M${BOX.left} ${scales.y(seconds)}H${BOX.right}` }),
      text({ x: BOX.left - 6, y: scales.y(seconds) + 4, "text-anchor": "end" }, seconds),
    ]),
    ...scales.shares.map((share) => text({ x: BOX.right + 6, y: scales.share(share) + 4 }, shareText(share))),
    ...scales.margins.map((margin) =>
      text({ x: scales.x(margin), y: BOX.bottom + 16, "text-anchor": "middle" }, margin),
    ),
    text(
      { x: (BOX.left + BOX.right) / 2, y: HEIGHT - 8, "text-anchor": "middle" },
      `error margin [${unitOf(error)}]`,
    ),
    text(
      { x: 12, y: HEIGHT / 2 - 16, "text-anchor": "middle", transform: `rotate(-90 12 ${HEIGHT / 2 - 16})` },
      "seconds",
    ),
    text(
      {
        x: WIDTH - 11,
        y: HEIGHT / 2 - 16,
        "text-anchor": "middle",
        transform: `rotate(90 ${WIDTH - 11} ${HEIGHT / 2 - 16})`,
      },
      "share remaining",
    ),
  ];
}
