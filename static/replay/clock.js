/** The time of a replay: it runs at a speed, stands, or is put somewhere. */

const LEFT_OF_IDLE = 0.5; // seconds that an idle stretch still lasts where it is skipped

/** `onTime(seconds)` is told of every change; `onPlaying(isPlaying)` of starts and stops. */
export function playbackClock({ duration, idle, onTime, onPlaying }) {
  let seconds = 0;
  let speed = 1;
  let skipsIdle = true;
  let ticking = 0;
  let before = null;

  function put(newSeconds) {
    seconds = Math.min(Math.max(newSeconds, 0), duration);
    onTime(seconds);
  }

  function tick(now) {
    ticking = requestAnimationFrame(tick);
    const passed = before === null ? 0 : (now - before) / 1000;
    before = now;
    put(withoutIdle(seconds + passed * speed));
    if (seconds >= duration) pause();
  }

  function withoutIdle(wanted) {
    const stretch = skipsIdle && idle.find(({ start, end }) => wanted > start + LEFT_OF_IDLE && wanted < end);
    return stretch ? stretch.end : wanted;
  }

  function play() {
    if (seconds >= duration) put(0);
    before = null;
    ticking ||= requestAnimationFrame(tick);
    onPlaying(true);
  }

  function pause() {
    cancelAnimationFrame(ticking);
    ticking = 0;
    onPlaying(false);
  }

  return {
    put,
    pause,
    toggle: () => (ticking ? pause() : play()),
    seconds: () => seconds,
    setSpeed: (newSpeed) => (speed = newSpeed),
    setSkipsIdle: (skips) => (skipsIdle = skips),
  };
}

/**
 * "1:02:03.4", "0:07.5".
 *
 * @param {number} seconds
 */
export function clockText(seconds) {
  const tenths = Math.round(seconds * 10);
  const [hours, minutes] = [Math.floor(tenths / 36000), Math.floor(tenths / 600) % 60];
  const rest = ((tenths % 600) / 10).toFixed(1).padStart(4, "0");
  return hours ? `${hours}:${String(minutes).padStart(2, "0")}:${rest}` : `${minutes}:${rest}`;
}
