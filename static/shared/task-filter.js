/**
 * Which tasks somebody works on (of a dataset, a scene, in a state, a mode, under a condition), kept in the
 * addresses of the pages.
 */

/** What is chosen within a dataset, or all. */
export const CHOICES = /** @type {const} */ (["scene_id", "state", "mode", "condition"]);
const NAMES = ["dataset_id", ...CHOICES];

/** @typedef {{ dataset_id: string | null, scene_id: string | null, state: string | null, mode: string | null, condition: string | null }} TaskFilter */

/**
 * The filter in the query of an address; what it leaves open is null.
 *
 * @param {string} query
 * @returns {TaskFilter}
 */
export function filterIn(query) {
  const given = new URLSearchParams(query);
  return /** @type {any} */ (Object.fromEntries(NAMES.map((name) => [name, given.get(name)])));
}

/** Whether it asks for a part of a dataset. @param {TaskFilter} filter */
export const isNarrow = (filter) => CHOICES.some((name) => filter[name]);

/**
 * The address of a page that goes by the filter.
 *
 * @param {string} path
 * @param {TaskFilter} filter
 */
export function addressWith(path, filter) {
  const query = new URLSearchParams();
  for (const [name, value] of Object.entries(filter)) if (value !== null) query.set(name, value);
  return query.size ? `${path}?${query}` : path;
}
