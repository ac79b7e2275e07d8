/**
 * Which tasks somebody works on (of a dataset, a scene, in a state, a mode, under a condition), kept in the
 * addresses of the pages.
 */

/** What is chosen within a dataset, or all. */
export const CHOICES = ["scene_id", "state", "mode", "condition"];
const NAMES = ["dataset_id", ...CHOICES];

/** The filter in the query of an address; what it leaves open is null. */
export function filterIn(query) {
  const given = new URLSearchParams(query);
  return Object.fromEntries(NAMES.map((name) => [name, given.get(name)]));
}

/** Whether it asks for a part of a dataset. */
export const isNarrow = (filter) => CHOICES.some((name) => filter[name]);

/** The address of a page that goes by the filter. */
export function addressWith(path, filter) {
  const query = new URLSearchParams(Object.entries(filter).filter(([, value]) => value !== null));
  return query.size ? `${path}?${query}` : path;
}
