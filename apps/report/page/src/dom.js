// Elements made from data. All text goes through text nodes, so that nothing in a file's
// name can become markup.

const kSvg = 'http://www.w3.org/2000/svg';

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else if (name in element && !(element instanceof SVGElement)) element[name] = value;
    else if (value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children.flat().filter((child) => child !== null));
  return element;
}

export const el = (tag, attributes = {}, ...children) =>
  fill(document.createElement(tag), attributes, children);

export const svg = (tag, attributes = {}, ...children) =>
  fill(document.createElementNS(kSvg, tag), attributes, children);

export const byId = (id) => document.getElementById(id);

export function swatch(color) {
  const box = svg('rect', { width: 11, height: 11, rx: 2, fill: color });
  return svg('svg', { class: 'swatch', width: 11, height: 11, 'aria-hidden': 'true' }, box);
}

export const cssColor = (name) =>
  getComputedStyle(document.documentElement).getPropertyValue(name).trim();
