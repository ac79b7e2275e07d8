/** The server's REST interface: JSON in and out, problems as errors, sign-in when the login has ended. */

const UNAUTHORIZED = 401;
/** @type {() => Promise<unknown>} */
let signInAgain = goToSignIn;

/** A call that did not succeed; `message` is one sentence for people. `status` is 0 without an answer. */
export class ApiError extends Error {
  /**
   * @param {number} status
   * @param {string} message
   */
  constructor(status, message) {
    super(message);
    this.name = "ApiError";
    this.status = status;
  }
}

export const UNREACHABLE = "The server cannot be reached. Nothing is lost; try again in a moment.";

/**
 * @template {string} Path
 * @param {Known<"get", Path>} path
 * @param {Query<Path>} [params]
 * @returns {Promise<Answer<"get", Path>>}
 */
export const get = (path, params) => request("GET", withQuery(path, params));

/**
 * @template {string} Path
 * @param {Known<"post", Path>} path
 * @param {Sent<"post", Path>} [body]
 * @returns {Promise<Answer<"post", Path>>}
 */
export const post = (path, body) => request("POST", path, body);

/**
 * @template {string} Path
 * @param {Known<"put", Path>} path
 * @param {Sent<"put", Path>} [body]
 * @returns {Promise<Answer<"put", Path>>}
 */
export const put = (path, body) => request("PUT", path, body);

/**
 * @template {string} Path
 * @param {Known<"delete", Path>} path
 */
export const del = (path) => request("DELETE", path);

/** REST's description of itself, the one thing that it does not describe. */
export const getDescription = () => request("GET", "/api/openapi.json");

/**
 * All items of a paged list.
 *
 * @template {string} Path
 * @param {Known<"get", Path>} path
 * @param {Omit<Query<Path>, "limit" | "after">} [params]
 * @returns {Promise<Answer<"get", Path> extends { items: (infer Item)[] } ? Item[] : never>}
 */
export async function getAll(path, params) {
  /** @type {any} */
  const items = [];
  let after = null;
  do {
    /** @type {any} */
    const page = await request("GET", withQuery(path, { ...params, limit: 200, after }));
    items.push(...page.items);
    after = page.next;
  } while (after !== null && after !== undefined);
  return items;
}

/**
 * The next task for me among those of a filter, or null when there is none.
 *
 * @param {Query<"/api/tasks/next">} filter
 */
export async function nextTask(filter) {
  try {
    return await get("/api/tasks/next", filter);
  } catch (error) {
    if (error instanceof ApiError && error.status === 404) return null;
    throw error;
  }
}

/**
 * Who is signed in, or null; nobody is asked to sign in for this.
 *
 * @returns {Promise<Rest["Me"] | null>}
 */
export async function whoIsSignedIn() {
  try {
    return await requestOnce("GET", "/api/me");
  } catch (error) {
    if (error.status === UNAUTHORIZED) return null;
    throw error;
  }
}

/**
 * The sentence to show for a failed answer with the given body text.
 *
 * @param {number} status
 * @param {string} text
 * @returns {string}
 */
export function problemSentence(status, text) {
  try {
    const { detail, title } = JSON.parse(text);
    const sentence = [detail, title].find((part) => typeof part === "string" && part !== "");
    if (sentence) return sentence;
  } catch {
    // Not JSON: a proxy or a crash answered instead of the app.
  }
  return `The server answered with error ${status}. Nothing was changed.`;
}

/**
 * Lets `ask` sign somebody in where the login has ended, in place of the sign-in page. What was asked of the
 * server meanwhile is asked again once the promise of `ask` is fulfilled.
 *
 * @param {() => Promise<unknown>} ask
 */
export function onSignedOut(ask) {
  signInAgain = ask;
}

/** Goes to the sign-in page, which comes back here afterwards; nothing that waits for it runs. */
export function goToSignIn() {
  location.assign(`/sign-in?next=${encodeURIComponent(location.pathname + location.search)}`);
  return new Promise(() => {});
}

/**
 * @param {string} path
 * @param {Record<string, any>} [params]
 */
function withQuery(path, params = {}) {
  const isGiven = (/** @type {unknown} */ value) => value !== null && value !== undefined && value !== "";
  const given = Object.entries(params).filter(([, value]) => isGiven(value));
  return given.length ? `${path}?${new URLSearchParams(given)}` : path;
}

/**
 * @param {string} method
 * @param {string} path
 * @param {unknown} [body]
 * @returns {Promise<any>}
 */
async function request(method, path, body) {
  try {
    return await requestOnce(method, path, body);
  } catch (error) {
    if (error.status !== UNAUTHORIZED || path.startsWith("/api/sign-in")) throw error;
    await signInAgain();
    return request(method, path, body);
  }
}

/**
 * @param {string} method
 * @param {string} path
 * @param {unknown} [body]
 */
async function requestOnce(method, path, body) {
  /** @type {RequestInit & { headers: Record<string, string> }} */
  const options = { method, headers: { Accept: "application/json" } };
  if (body !== undefined) {
    options.headers["Content-Type"] = "application/json";
    options.body = JSON.stringify(body);
  }
  let answer;
  try {
    answer = await fetch(path, options);
  } catch {
    throw new ApiError(0, UNREACHABLE);
  }
  const text = await answer.text();
  if (!answer.ok) throw new ApiError(answer.status, problemSentence(answer.status, text));
  return text ? JSON.parse(text) : null;
}
