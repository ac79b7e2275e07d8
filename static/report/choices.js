/** The choices above a report, kept in the page's address. */

import { byId, element } from "../shared/dom.js";

const ALL = "All";

/**
 * Shows a select for each of `fields`, {name, label, options, all}: `all` adds "All". Calls `onChange(values)` with the
 * chosen ones, empty for all, now and after each change.
 */
export function setUpChoices(fields, onChange) {
  const form = byId("choices");
  const asked = new URLSearchParams(location.search);
  const selects = fields.map(({ name, label, options, all, chosen }) => {
    const select = element("select", { name });
    const choices = options.map((option) => (Array.isArray(option) ? option : [option, option]));
    select.append(
      ...(all ? [new Option(ALL, "")] : []),
      ...choices.map(([value, text]) => new Option(text, value)),
    );
    const wanted = asked.get(name) ?? chosen ?? "";
    if (choices.some(([value]) => value === wanted)) select.value = wanted;
    return element("label", { className: "field" }, element("span", {}, label), select);
  });
  form.replaceChildren(...selects);

  const tell = () => {
    const values = /** @type {Record<string, string>} */ (Object.fromEntries(new FormData(form)));
    const given = Object.entries(values).filter(([, value]) => value !== "");
    history.replaceState(null, "", `${location.pathname}?${new URLSearchParams(given)}`);
    return onChange(values);
  };
  form.addEventListener("change", tell);
  form.addEventListener("submit", (event) => event.preventDefault());
  return tell();
}

export const ERROR_FIELD = {
  name: "error",
  label: "Error",
  options: [
    ["translation", "translation"],
    ["rotation", "rotation"],
  ],
  all: true,
};

/** The errors to show, of what was chosen. */
export const errorsOf = ({ error }) => (error ? [error] : ["translation", "rotation"]);
