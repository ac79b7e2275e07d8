/** The registration as it changes, by server-sent events that reconnect by themselves. */

import { ApiError } from "../api.js";

const RETRY_MS = 1000;
/** Tells this page from others of the same registration: the newest takes over. */
const PAGE = crypto.getRandomValues(new Uint32Array(4)).join("-").slice(0, 40);

/**
 * Follows a registration. `resume` is awaited before each reconnect: it checks the login and starts the view
 * again if the server was restarted. Handlers: onRegistration(registration), onLost(), onTakenOver(), and
 * onRefused(error) when the server is there again but will not have it.
 */
export function followRegistration(id, { resume, onRegistration, onLost, onTakenOver, onRefused }) {
  function connect() {
    const source = new EventSource(`/api/registrations/${id}/stream?page=${PAGE}`);
    source.addEventListener("registration", (event) => onRegistration(JSON.parse(event.data)));
    source.addEventListener("taken_over", () => {
      source.close();
      onTakenOver();
    });
    source.addEventListener("error", () => {
      // EventSource gives up after an HTTP error and hides which one it was: do the reconnecting here.
      source.close();
      onLost();
      setTimeout(reconnect, RETRY_MS);
    });
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
}
