/** The registration as it changes, by server-sent events that reconnect by themselves. */

import { ApiError } from "../shared/api.js";

const RETRY_MS = 1000;
/** The server tells something every ten seconds: after a longer silence the connection is dead, as after a sleep. */
const LONGEST_SILENCE_MS = 25_000;
/** Tells this page from others of the same registration: the newest takes over. */
const PAGE = crypto.getRandomValues(new Uint32Array(4)).join("-").slice(0, 40);

/**
 * Follows a registration. `resume` is awaited before each reconnect: it checks the login and starts the view
 * again if the server was restarted. Handlers: onRegistration(registration), onLost(), onTakenOver(), and
 * onRefused(error) when the server is there again but will not have it.
 */
export function followRegistration(id, { resume, onRegistration, onLost, onTakenOver, onRefused }) {
  let source = null;
  let heardAt = 0;

  function connect() {
    source = new EventSource(`/api/registrations/${id}/stream?page=${PAGE}`);
    heardAt = Date.now();
    source.addEventListener("registration", (event) => {
      heardAt = Date.now();
      onRegistration(JSON.parse(event.data));
    });
    source.addEventListener("taken_over", () => {
      leave();
      onTakenOver();
    });
    // EventSource gives up after an HTTP error and hides which one it was: do the reconnecting here.
    source.addEventListener("error", lose);
  }

  function leave() {
    source.close();
    source = null;
  }

  function lose() {
    leave();
    onLost();
    setTimeout(reconnect, RETRY_MS);
  }

  async function reconnect() {
    try {
      await resume();
      connect();
    } catch (error) {
      if (error instanceof ApiError && error.status >= 400 && error.status < 500) onRefused(error);
      else setTimeout(reconnect, RETRY_MS);
    }
  }

  connect();
  setInterval(() => source && Date.now() - heardAt > LONGEST_SILENCE_MS && lose(), RETRY_MS);
}
