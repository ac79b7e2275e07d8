/** Looking closer at a picture: wheel, drag and keys move it within its box. */

const STEP = 1.5;
const MOST = 40; // times as large as the whole picture in its box
const FILLED = 0.62; // share of the box that something takes when it is fitted
const KEY_SHIFT = 40; // page pixels
const LINE = 33; // wheel units to a line

/**
 * Makes the picture in `box` zoomable. `onChange({scale, left, top})` is told how to show it: page pixels to
 * a pixel of the picture, and where in the box the picture's corner lies [page pixels].
 *
 * @param {HTMLElement} box
 * @param {(view: Shown) => void} onChange
 */
export function zoomable(box, onChange) {
  let size = { width: 1, height: 1 };
  let times = 1; // as large as the whole picture
  let middle = { x: 0.5, y: 0.5 }; // of what is seen, pixels of the picture from its corner

  const wholeScale = () => Math.min(box.clientWidth / size.width, box.clientHeight / size.height);
  const scale = () => times * wholeScale();

  function show(newTimes, x, y) {
    times = limited(newTimes);
    middle = {
      x: held(x, size.width, box.clientWidth / scale()),
      y: held(y, size.height, box.clientHeight / scale()),
    };
    onChange({
      scale: scale(),
      left: box.clientWidth / 2 - middle.x * scale(),
      top: box.clientHeight / 2 - middle.y * scale(),
    });
  }

  const whole = () => show(1, 0, 0);
  const pan = (right, down) => show(times, middle.x - right / scale(), middle.y - down / scale());

  /** Zooms by `factor`; what is (right, down) of the box's middle [page pixels] stays there. */
  function by(factor, right = 0, down = 0) {
    const shift = 1 / scale() - 1 / (limited(times * factor) * wholeScale());
    show(times * factor, middle.x + right * shift, middle.y + down * shift);
  }

  /** Shows a rectangle of the picture [its pixels, from its corner] large. */
  function fit({ left, top, right, bottom }) {
    const most = Math.min(box.clientWidth / (right - left), box.clientHeight / (bottom - top));
    show((FILLED * most) / wholeScale(), (left + right) / 2, (top + bottom) / 2);
  }

  function setSize(width, height) {
    if (width === size.width && height === size.height) return;
    size = { width, height };
    whole();
  }

  const keys = {
    "+": () => by(STEP),
    "=": () => by(STEP),
    "-": () => by(1 / STEP),
    ArrowLeft: () => pan(KEY_SHIFT, 0),
    ArrowRight: () => pan(-KEY_SHIFT, 0),
    ArrowUp: () => pan(0, KEY_SHIFT),
    ArrowDown: () => pan(0, -KEY_SHIFT),
  };
  box.addEventListener("keydown", (event) => {
    if (event.target !== box || event.ctrlKey || event.metaKey || !keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  });
  box.addEventListener("wheel", (event) => {
    event.preventDefault();
    const turned = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE : 1);
    const { left, top, width, height } = box.getBoundingClientRect();
    by(STEP ** (-turned / 100), event.clientX - left - width / 2, event.clientY - top - height / 2);
  });
  panByPointer(box, pan);
  new ResizeObserver(() => show(times, middle.x, middle.y)).observe(box);

  return {
    fit,
    whole,
    setSize,
    zoomIn: () => by(STEP),
    zoomOut: () => by(1 / STEP),
    isWhole: () => times === 1,
  };
}

const limited = (times) => Math.min(Math.max(times, 1), MOST);

/** Where the middle of what is seen may lie, so that as much of the picture shows as can. */
function held(middle, size, seen) {
  return seen >= size ? size / 2 : Math.min(Math.max(middle, seen / 2), size - seen / 2);
}

/** Moves the picture with the pointer. */
function panByPointer(box, pan) {
  let grip = null;
  box.addEventListener("pointerdown", (event) => {
    if (event.button !== 0 || event.target.closest("button")) return;
    grip = event;
    box.setPointerCapture(event.pointerId);
  });
  box.addEventListener("pointermove", (event) => {
    if (!grip) return;
    pan(event.clientX - grip.clientX, event.clientY - grip.clientY);
    grip = event;
  });
  box.addEventListener("lostpointercapture", () => (grip = null));
}
