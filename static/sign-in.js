/** Sign-in: with name and password, or by the one-time link /sign-in#TOKEN. */

import { post } from "./shared/api.js";
import { byId } from "./shared/dom.js";
import { messageArea } from "./shared/message.js";

const form = byId("sign-in");
const message = messageArea(byId("message"));

signInByLink();
window.addEventListener("hashchange", signInByLink); // a link pasted into this tab does not load the page again
form.addEventListener("submit", signInByPassword);

async function signInByLink() {
  const token = decodeURIComponent(location.hash.slice(1));
  if (!token) return;
  // The token must not stay in the address, from where it would reach the history.
  history.replaceState(null, "", location.pathname + location.search);
  message.clear();
  setLinking(true);
  try {
    await post("/api/sign-in/link", { token });
    goOn();
  } catch (error) {
    setLinking(false);
    message.problem(error);
  }
}

async function signInByPassword(event) {
  event.preventDefault();
  message.clear();
  byId("submit").disabled = true;
  try {
    await post("/api/sign-in", { name: byId("name").value.trim(), password: byId("password").value });
    goOn();
  } catch (error) {
    message.problem(error);
    byId("submit").disabled = false;
    byId("password").select();
  }
}

function setLinking(linking) {
  form.hidden = linking;
  byId("linking").hidden = !linking;
}

function goOn() {
  location.replace(nextPath(new URLSearchParams(location.search).get("next")));
}

/** The path to go to: only ever one of this site. */
function nextPath(next) {
  if (!next) return "/";
  const url = URL.canParse(next, location.origin) ? new URL(next, location.origin) : null;
  return next.startsWith("/") && url?.origin === location.origin ? url.pathname + url.search : "/";
}
