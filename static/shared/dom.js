/** Small helpers for building and changing elements. */

/**
 * The element of this page with an id; types/elements.d.ts knows them all.
 *
 * @template {string} Id
 * @param {KnownId<Id>} id
 * @returns {ElementOf<Id>}
 */
export const byId = (id) => /** @type {any} */ (document.getElementById(id));

/**
 * A new element; `props` are properties, or attributes where the name has a dash or is `role`, `for`.
 *
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Record<string, any>} props
 * @param {...(Node | string | number | null)} children
 * @returns {HTMLElementTagNameMap[Tag]}
 */
export function element(tag, props = {}, ...children) {
  const node = /** @type {HTMLElementTagNameMap[Tag] & Record<string, any>} */ (document.createElement(tag));
  for (const [name, value] of Object.entries(props)) {
    if (name.includes("-") || name === "role" || name === "for") node.setAttribute(name, value);
    else node[name] = value;
  }
  node.append(...children.filter((child) => child !== null).map(asNode));
  return node;
}

/** @param {Node | string | number} child */
const asNode = (child) => (typeof child === "number" ? String(child) : child);

const SVG = "http://www.w3.org/2000/svg";

/**
 * A new element of SVG with these attributes.
 *
 * @template {keyof SVGElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Record<string, string | number | boolean>} attributes
 * @param {...(Node | string | number)} children
 */
export function svg(tag, attributes, ...children) {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, String(value));
  node.append(...children.map(asNode));
  return node;
}

/** A decorative icon of `icons.svg`. @param {string} name */
export function icon(name) {
  return svg(
    "svg",
    { class: "icon", "aria-hidden": true },
    svg("use", { href: `/static/icons.svg#${name}` }),
  );
}

/**
 * A picture that leaves a cube in its place while it loads and when there is none.
 *
 * @param {string | null | undefined} url
 * @param {string} className
 */
export function picture(url, className, { lazy = false } = {}) {
  const placeholder = icon("cube");
  const frame = element("span", { className: `picture ${className}` }, placeholder);
  if (url) {
    const image = element("img", { alt: "", loading: lazy ? "lazy" : "eager", src: url });
    image.addEventListener("load", () => placeholder.remove());
    image.addEventListener("error", () => image.remove());
    frame.append(image);
  }
  return frame;
}

/**
 * Sets the text only when it changes, so that live regions stay quiet.
 *
 * @param {Node} node
 * @param {string} text
 */
export function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

/** A colour of the style sheet as [red, green, blue] from 0 to 1. @param {string} color */
export function rgb(color) {
  const numbers = color.match(/[\d.]+/g) ?? [];
  return numbers.slice(0, 3).map((value) => Number(value) / 255);
}
