/** Signing in without leaving the page, where the login has ended: the page then goes on where it was. */

import { get, onSignedOut, post, whoIsSignedIn } from "../shared/api.js";
import { byId, setText } from "../shared/dom.js";
import { messageArea } from "../shared/message.js";

const HOME = { label: "Back to the tasks", run: () => location.assign("/") };

/**
 * Makes the dialog and returns who is signed in: {id, name}. Should the login end, the dialog asks for the same
 * person; `onBack` is called when they are there again.
 *
 * @param {() => void} onBack
 */
export async function signInAgainHere(onBack) {
  const dialog = byId("sign-in-again");
  const message = messageArea(byId("sign-in-message"));
  const me = await get("/api/me");
  let waiting = null;

  function ask() {
    waiting ??= Promise.withResolvers();
    if (!dialog.open) show();
    return waiting.promise;
  }

  function show() {
    message.clear();
    byId("sign-in-name").value = me.name;
    setText(byId("sign-in-who"), me.name);
    dialog.showModal();
    byId("sign-in-password").focus();
  }

  async function signIn(event) {
    event.preventDefault();
    const password = byId("sign-in-password");
    const name = byId("sign-in-name").value.trim();
    await tried(() => post("/api/sign-in", { name, password: password.value }));
    password.value = "";
  }

  /** Runs `signing`, and goes on if the right person is signed in then. */
  async function tried(signing) {
    message.clear();
    try {
      await signing();
      const now = await whoIsSignedIn();
      if (now === null) message.show("Nobody is signed in yet: open the link in another tab first.");
      else if (now.id === me.id) goOn();
      else message.show(`You are ${now.name} now; this is the work of ${me.name}.`, "problem", HOME);
    } catch (error) {
      message.problem(error);
    }
  }

  function goOn() {
    const { resolve } = waiting;
    waiting = null;
    dialog.close();
    resolve();
    onBack();
  }

  byId("sign-in-form").addEventListener("submit", signIn);
  byId("sign-in-elsewhere").addEventListener("click", () => tried(async () => {}));
  // Without a login there is nothing to go back to: Escape does not close it.
  dialog.addEventListener("keydown", (event) => event.key === "Escape" && event.preventDefault());
  onSignedOut(ask);
  return me;
}
