import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { clockText, playbackClock } from "../../../static/replay/clock.js";

let waiting; // what is to be called at the next picture of the screen
let times;
let plays;
let clock;

beforeEach(() => {
  waiting = null;
  globalThis.requestAnimationFrame = (run) => {
    waiting = run;
    return 1;
  };
  globalThis.cancelAnimationFrame = () => {
    waiting = null;
  };
  times = [];
  plays = [];
  clock = playbackClock({
    duration: 100,
    idle: [{ start: 10, end: 40 }],
    onTime: (seconds) => times.push(seconds),
    onPlaying: (isPlaying) => plays.push(isPlaying),
  });
});

/** Lets pictures of the screen come at these milliseconds. */
function passTo(...moments) {
  for (const moment of moments) waiting(moment);
}

test("it is put within the registration, never beside it", () => {
  for (const seconds of [5, -3, 200]) clock.put(seconds);
  assert.deepEqual(times, [5, 0, 100]);
});

test("it runs at its speed from where it stands", () => {
  clock.put(50);
  clock.toggle();
  passTo(1000, 2000);
  clock.setSpeed(4);
  passTo(2500);
  assert.deepEqual(times, [50, 50, 51, 53]);
});

test("idle time is left out but for a moment, unless it is asked for", () => {
  clock.put(10);
  clock.toggle();
  passTo(0, 400, 800);
  assert.deepEqual(times.slice(2), [10.4, 40]);
  clock.setSkipsIdle(false);
  clock.put(10);
  passTo(2800);
  assert.equal(clock.seconds(), 12);
});

test("it stops at the end, and begins anew after it", () => {
  clock.put(99);
  clock.toggle();
  passTo(0, 5000);
  assert.deepEqual([clock.seconds(), plays.at(-1), waiting], [100, false, null]);
  clock.toggle();
  assert.deepEqual([clock.seconds(), plays.at(-1)], [0, true]);
});

test("times are read to the tenth, with hours where there are some", () => {
  assert.deepEqual([0, 7.46, 59.96, 600, 3723.4].map(clockText), [
    "0:00.0",
    "0:07.5",
    "1:00.0",
    "10:00.0",
    "1:02:03.4",
  ]);
});
