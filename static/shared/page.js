/** What the pages share: their header, with the way from one to another, and how they open. */

import { get, post } from "./api.js";
import { byId, element } from "./dom.js";

const EVERYBODY = ["operator", "reviewer", "admin"];
const PAGES = [
  { name: "Home", path: "/", roles: EVERYBODY },
  { name: "Team", path: "/report/team", roles: ["reviewer", "admin"] },
  { name: "Studies", path: "/studies", roles: ["admin"] },
  { name: "Export", path: "/export", roles: ["admin"] },
];

/**
 * Fills the header, then lets `show({id, name, role})` show the page, and returns what that returns. Until then the
 * page says that it loads; where it cannot, the message area says why.
 *
 * @template Shown
 * @param {Message} message
 * @param {(me: Rest["Me"]) => Promise<Shown>} show
 */
export async function openPage(message, show) {
  try {
    const me = await get("/api/me");
    showHeader(me);
    return await show(me);
  } catch (error) {
    message.problem(error, { label: "Try again", run: () => location.reload() });
    return null;
  } finally {
    document.querySelector("main")?.removeAttribute("aria-busy");
  }
}

function showHeader(/** @type {Rest["Me"]} */ { name, role }) {
  byId("pages").replaceChildren(...PAGES.filter(({ roles }) => roles.includes(role)).map(pageLink));
  const who = element(
    "span",
    { className: "who", title: name },
    element("span", { className: "visually-hidden" }, "Signed in as "),
    name,
  );
  const out = element("button", { type: "button", className: "button quiet", onclick: signOut }, "Sign out");
  byId("account").replaceChildren(who, element("span", { className: "role" }, role), out);
}

function pageLink(/** @type {{ name: string, path: string }} */ { name, path }) {
  const link = element("a", { href: path }, name);
  if (path === location.pathname) link.setAttribute("aria-current", "page");
  return link;
}

async function signOut() {
  await post("/api/sign-out");
  location.assign("/sign-in");
}
