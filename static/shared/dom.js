/** Small helpers for building and changing elements. */

export const byId = (id) => document.getElementById(id);

/** A new element; `props` are properties, or attributes where the name has a dash or is `role`, `for`. */
export function element(tag, props = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(props)) {
    if (name.includes("-") || name === "role" || name === "for") node.setAttribute(name, value);
    else node[name] = value;
  }
  node.append(...children.filter((child) => child !== null));
  return node;
}

const SVG = "http://www.w3.org/2000/svg";

/** A new element of SVG with these attributes. */
export function svg(tag, attributes, ...children) {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  node.append(...children);
  return node;
}

/** A decorative icon of `icons.svg`. */
export function icon(name) {
  return svg(
    "svg",
    { class: "icon", "aria-hidden": true },
    svg("use", { href: `/static/icons.svg#${name}` }),
  );
}

/** A picture that leaves a cube in its place while it loads and when there is none. */
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

/** Sets the text only when it changes, so that live regions stay quiet. */
export function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

/** A colour of the style sheet as [red, green, blue] from 0 to 1. */
export function rgb(color) {
  return color
    .match(/[\d.]+/g)
    .slice(0, 3)
    .map((value) => value / 255);
}
