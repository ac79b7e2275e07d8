/** Numbers as people read them. */

/** What a snap is computed with: in a list of choices, and in a sentence. */
export const METHODS = {
  default: { choice: "Fast", name: "fast" },
  paper: { choice: "Paper’s filter (5–10 s)", name: "paper’s filter" },
};

/**
 * "1 scene", "3 scenes".
 *
 * @param {number} number
 * @param {string} noun
 */
export function count(number, noun) {
  return `${number.toLocaleString("en")} ${noun}${number === 1 ? "" : "s"}`;
}

/** "5 %", "0.5 %" of a share. @param {number} share */
export function percent(share) {
  return `${Number((100 * share).toPrecision(3))} %`;
}

/** "12 kB", "8.4 MB", "312 MB". @param {number} bytes */
export function fileSize(bytes) {
  if (bytes < 1e6) return `${Math.ceil(bytes / 1e3)} kB`;
  return `${(bytes / 1e6).toFixed(bytes < 1e7 ? 1 : 0)} MB`;
}

/**
 * "3 frames", "3 frames, 2 of 2 others agree"; empty where there is one frame and nothing to add.
 *
 * @param {Rest["FramesReport"] | null} frames
 */
export function framesText(frames) {
  if (!frames) return "";
  const { used, agreeing, asked } = frames;
  const others =
    asked === 0 ? "" : `${agreeing} of ${asked} ${asked === 1 ? "other agrees" : "others agree"}`;
  if (used === 1 && !others) return "";
  return [`${used} ${used === 1 ? "frame" : "frames"}`, others].filter(Boolean).join(", ");
}
