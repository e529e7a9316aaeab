// Makes elements of the page. Foreign text only becomes text nodes.

/**
 * @param {string} name
 * @param {Record<string, string>} attributes
 * @param {(Node | string)[]} children
 * @returns {HTMLElement}
 */
export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

/**
 * @param {string} name
 * @param {Record<string, string | number>} attributes
 * @param {(Node | string)[]} children
 * @returns {SVGElement}
 */
export function drawn(name, attributes = {}, ...children) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  made.append(...children);
  return made;
}

/**
 * A number with three significant digits, a true minus sign, and an exponent only where necessary.
 * @param {number} value
 * @returns {string}
 */
export function shortNumber(value) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  const text = size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(2) : String(Number(value.toPrecision(3)));
  return text.replaceAll("-", "\u2212");
}

/**
 * A cell of a table: a text, optionally with its JSON pointer in the results.
 * @param {string | {text: string, at?: string, strong?: boolean}} cell
 * @param {string} name of the element
 * @returns {HTMLElement}
 */
export function cellElement(cell, name = "td") {
  if (typeof cell === "string") return element(name, {}, cell);
  const made = element(name, cell.at ? {"data-at": cell.at} : {}, cell.text);
  if (cell.at) made.classList.add("number");
  if (cell.strong) made.classList.add("strong");
  return made;
}
