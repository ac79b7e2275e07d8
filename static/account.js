/** The signed-in person in the header. */

import { get, post } from "./api.js";
import { byId, setText } from "./dom.js";

/** Fills `#me-name` and `#me-role`, makes `#sign-out` work; returns {id, name, role}. */
export async function showAccount() {
  const me = await get("/api/me");
  setText(byId("me-name"), me.name);
  setText(byId("me-role"), me.role);
  byId("sign-out").addEventListener("click", async () => {
    await post("/api/sign-out");
    location.assign("/sign-in");
  });
  byId("account").hidden = false;
  return me;
}
