/**
 * How events look on the time line: a sign for each kind, told apart by shape as well as by colour.
 * A sign draws itself into a lane as SVG path data, from its place x to `end`, y in pixels.
 */

const MIDDLE = 10; // of a lane, pixels
const LEAST_WIDTH = 3;

const bar = (height) => (x, end) =>
  `M${x} ${MIDDLE - height / 2}h${Math.max(end - x, LEAST_WIDTH)}v${height}H${x}Z`;
const tick = (_x, x) => `M${x - 1} 3h2v14h-2Z`;
const toLeft = (_x, x) => `M${x - 4} 10l8-5v10Z`;
const toRight = (_x, x) => `M${x + 4} 10l-8-5v10Z`;
const diamond = (_x, x) => `M${x} 4l6 6-6 6-6-6Z`;
const cross = (_x, x) => `M${x - 4} 6l8 8M${x + 4} 6l-8 8`;
const flag = (_x, x) => `M${x - 1} 2h2v16h-2ZM${x - 1} 2l-9 4 9 4Z`;
const bars = bar(12);

/** {name, kinds, lane, path, look}; `look` is a class of replay.css. */
export const SIGNS = [
  { name: "drag", kinds: ["drag"], lane: "human", path: bars, look: "full" },
  { name: "set", kinds: ["set_pose"], lane: "human", path: tick, look: "full" },
  { name: "undo", kinds: ["undo"], lane: "human", path: toLeft, look: "plain" },
  { name: "redo", kinds: ["redo"], lane: "human", path: toRight, look: "plain" },
  { name: "reset", kinds: ["reset"], lane: "human", path: cross, look: "line" },
  { name: "submit", kinds: ["submit"], lane: "human", path: flag, look: "plain" },
  { name: "snap applied", kinds: ["snap_applied"], lane: "machine", path: bars, look: "full" },
  { name: "snap offered", kinds: ["snap_offered"], lane: "machine", path: bars, look: "hollow" },
  {
    name: "snap failed or cancelled",
    kinds: ["snap_failed", "snap_cancelled"],
    lane: "machine",
    path: cross,
    look: "line",
  },
  { name: "accept", kinds: ["accept"], lane: "machine", path: diamond, look: "full" },
  { name: "view moved", kinds: ["view"], lane: "view", path: bar(4), look: "full" },
];

const LANES = ["human", "machine", "view"];
export const LANE_HEIGHT = 2 * MIDDLE;
export const laneTop = (lane) => LANES.indexOf(lane) * LANE_HEIGHT;
