/** Asks for what is to be shown, one request at a time, always the newest: a slow line shows less, never later. */

const LEAST_MS = 33; // between two requests

/** Makes `present(wanted)`: `ask(wanted)` is awaited, its answer handed to `draw`, an error to `onProblem`. */
export function presenter(ask, draw, onProblem) {
  let next = null;
  let isBusy = false;

  async function work() {
    isBusy = true;
    while (next !== null) {
      const [wanted] = next;
      next = null;
      try {
        const [answer] = await Promise.all([ask(wanted), new Promise((done) => setTimeout(done, LEAST_MS))]);
        draw(answer);
      } catch (error) {
        onProblem(error);
      }
    }
    isBusy = false;
  }

  return (wanted) => {
    next = [wanted];
    if (!isBusy) work();
  };
}
