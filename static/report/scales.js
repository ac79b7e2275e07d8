/** Where margins, seconds and shares lie in a chart; margins go from large to small, in powers. */

export const WIDTH = 560;
export const HEIGHT = 300;
const LEFT = 46;
const RIGHT = 54;
const TOP = 12;
const BOTTOM = 44;

export const BOX = { left: LEFT, right: WIDTH - RIGHT, top: TOP, bottom: HEIGHT - BOTTOM };

const TICKS = { translation: [100, 50, 20, 10, 5, 2, 1], rotation: [90, 45, 20, 10, 5, 2, 1] };
const STEPS = [0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 3600];
const MOST_TICKS = 6;

/** Of series with points in people's units; `x(margin)`, `y(seconds)`, `share(part)` and their ticks. */
export function scalesOf(series, error) {
  const points = series.flatMap((one) => one.points);
  const [largest, smallest] = [Math.max, Math.min].map((pick) => pick(...points.map(({ margin }) => margin)));
  const most = Math.max(1, ...points.map(({ seconds, high }) => Math.max(seconds ?? 0, high ?? 0)));
  const step = STEPS.find((size) => most / size <= MOST_TICKS) ?? most / MOST_TICKS;
  const top = Math.ceil(most / step) * step;
  const across = Math.log(largest / smallest);
  const upward = (part) => round(BOX.bottom - part * (BOX.bottom - BOX.top));
  return {
    x: (margin) => round(BOX.left + (Math.log(largest / margin) / across) * (BOX.right - BOX.left)),
    y: (seconds) => upward(seconds / top),
    share: upward,
    margins: TICKS[error].filter((tick) => tick <= largest * 1.001 && tick >= smallest * 0.999),
    seconds: Array.from({ length: Math.round(top / step) + 1 }, (_, i) => i * step),
    shares: [0, 0.5, 1],
  };
}

const round = (value) => Math.round(value * 10) / 10;
