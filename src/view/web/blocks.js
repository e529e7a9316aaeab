// Turns the blocks of a section (src/view/page.hpp) into elements.
import {anatomyElement} from "./anatomy.js";
import {casesElement} from "./cases.js";
import {figureElement} from "./chart.js";
import {Designs} from "./designs.js";
import {cellElement, element} from "./dom.js";
import {Player} from "./player.js";

/** @typedef {Record<string, any>} Block */

/** @param {Block} block @returns {HTMLElement} */
function wordsElement(block) {
  return element("p", {class: block.style}, block.text);
}

/** @param {Block} block @returns {HTMLElement} */
function headingElement(block) {
  return element("h2", {class: "question"}, block.text);
}

/** @param {Block} block @returns {HTMLElement} */
function tableElement(block) {
  const row = (/** @type {any[]} */ cells, /** @type {string} */ name) => element("tr", {}, ...cells.map((cell, k) => cellElement(cell, k === 0 && name === "td" ? "th" : name)));
  const made = element("figure", {class: block.head.length > 4 ? "table wide" : "table"});
  if (block.title) made.append(element("h3", {}, block.title));
  made.append(element("div", {class: "scroll", tabindex: "0", role: "region", "aria-label": block.title || "table"},
    element("table", {}, element("thead", {}, row(block.head, "th")), element("tbody", {}, ...block.rows.map((/** @type {any[]} */ cells) => row(cells, "td"))))));
  if (block.note) made.append(element("figcaption", {}, block.note));
  return made;
}

/**
 * Black or white, whichever has the larger contrast, which is at least 4.5 to 1 (WCAG 2.1, relative luminance).
 * @param {number[]} shade red, green, blue to 255
 * @returns {string}
 */
export function inkOn(shade) {
  const [r, g, b] = shade.map((v) => v / 255).map((v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
  return 0.2126 * r + 0.7152 * g + 0.0722 * b > 0.179 ? "#000000" : "#ffffff";
}

/**
 * A grid of numbers, darker for larger ones. The text stays readable on every shade.
 * @param {Block} block
 * @returns {HTMLElement}
 */
function matrixElement(block) {
  const most = block.most ?? Math.max(1, ...block.values.flat().filter((/** @type {number | null} */ v) => v !== null));
  const least = block.least ?? 0;
  const rows = block.rows.map((/** @type {string} */ name, /** @type {number} */ i) =>
    element("tr", {}, element("th", {scope: "row"}, name), ...block.values[i].map((/** @type {number | null} */ value, /** @type {number} */ k) => {
      const text = block.texts[i][k];
      if (value === null) return element("td", {}, text);
      const share = Math.min(1, Math.max(0, (value - least) / (most - least)));
      const shade = [[241, 245, 249], [8, 65, 107]].reduce((light, dark) => light.map((v, c) => Math.round(v + (dark[c] - v) * share)));
      const ring = block.marked?.[i]?.[k] ? "marked" : "";
      return element("td", {class: ring, style: `background: rgb(${shade.join(" ")}); color: ${inkOn(shade)}`}, text);
    })));
  const head = element("tr", {}, element("td", {}), ...block.columns.map((/** @type {string} */ name) => element("th", {scope: "col"}, element("span", {}, name))));
  const made = element("figure", {class: block.tilted ? "matrix tilted wide" : "matrix"}, element("h3", {}, block.title),
    element("div", {class: "scroll", tabindex: "0", role: "region", "aria-label": block.title}, element("table", {}, element("thead", {}, head), element("tbody", {}, ...rows))));
  if (block.note) made.append(element("figcaption", {}, block.note));
  return made;
}

/**
 * @param {Block} block
 * @param {Uint8Array} bytes
 * @param {(() => void)[]} later calls to make once all elements are in the page
 * @returns {HTMLElement}
 */
export function blockElement(block, bytes, later) {
  if (block.kind === "flights") {
    const player = new Player(/** @type {any} */ (block), bytes);
    later.push(() => player.start());
    window.players = [...window.players ?? [], player];  // for tests and for debugging in the browser
    return player.element;
  }
  if (block.kind === "robots") {
    const designs = new Designs(/** @type {any} */ (block));
    later.push(() => designs.start());
    return designs.element;
  }
  /** @type {Record<string, (block: any) => HTMLElement>} */
  const made = {words: wordsElement, heading: headingElement, figure: figureElement, table: tableElement, matrix: matrixElement, anatomy: anatomyElement,
    cases: casesElement};
  return made[block.kind](block);
}
